// `atlas wait`: until every change is in the tiles.
#include "client/cli/commands.h"
#include "client/cli/seconds.h"
#include "client/cli/text_table.h"

namespace atlas {
namespace {

class WaitCommand : public Command {
 public:
  std::string Name() const override { return "wait"; }
  std::string Summary() const override { return "Wait until everything uploaded is fused"; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Optional("--timeout", "S", timeout_s_,
                       "Give up (exit 5) after so many seconds [600]");
  }

  Status Run(CommandContext& context) override {
    const auto timeout = TimeoutFromSeconds(timeout_s_);
    if (!timeout) return timeout.error();
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const Result<WaitSummary> done = client->WaitUntilFused(*timeout);
    if (!done) return done.error();
    if (context.is_json) {
      context.PrintJson({{"revision", done->revision}, {"dirty_tiles", done->dirty_tiles}});
    } else {
      context.out << "all tiles are fused, revision " << done->revision << '\n';
    }
    return {};
  }

 private:
  double timeout_s_ = 600.0;
};

}  // namespace

std::unique_ptr<Command> MakeWaitCommand() {
  return std::make_unique<WaitCommand>();
}

}  // namespace atlas
