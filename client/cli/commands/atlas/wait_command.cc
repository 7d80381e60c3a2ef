// `atlas wait`: until every change is in the tiles.
#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/timeout_flag.h"
#include "client/cli/output/text_table.h"

namespace atlas {
namespace {

class WaitCommand : public Command {
 public:
  std::string Name() const override { return "wait"; }
  std::string Summary() const override { return "Wait until everything uploaded is fused"; }

  void Declare(ArgumentSet& arguments) override { DeclareTimeout(arguments, timeout_); }

  Status Run(CommandContext& context) override {
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const Result<WaitSummary> done = client->WaitUntilFused(timeout_);
    if (!done) return done.error();
    if (context.is_json) {
      context.PrintJson({{"revision", done->revision}, {"dirty_tiles", done->dirty_tiles}});
    } else {
      context.out << "all tiles are fused, revision " << done->revision << '\n';
    }
    return {};
  }

 private:
  std::chrono::milliseconds timeout_{600'000};
};

}  // namespace

std::unique_ptr<Command> MakeWaitCommand() {
  return std::make_unique<WaitCommand>();
}

}  // namespace atlas
