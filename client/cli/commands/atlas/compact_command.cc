// `atlas compact --before T`: keyframes that matter nowhere any more, dropped for good.
#include <cmath>

#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/author_flag.h"
#include "client/cli/commands/atlas/timeout_flag.h"
#include "client/cli/output/text_table.h"

namespace atlas {
namespace {

class CompactCommand : public Command {
 public:
  std::string Name() const override { return "compact"; }
  std::string Summary() const override {
    return "Drop keyframes that matter nowhere any more (preset bounded)";
  }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("--before", "T", before_s_,
                       "Only those taken before this time, seconds since 1970");
    author_.Declare(arguments);
    DeclareTimeout(arguments, timeout_);
  }

  Status Run(CommandContext& context) override {
    if (before_s_ < 0.0 || before_s_ > kLatest_s) {
      return {StatusCode::kInvalidArgument, "--before: expected seconds from 0 to 1e12"};
    }
    const Result<std::string> author = author_.Author("atlas-compact");
    if (!author) return author.error();
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const auto done = client->Compact(std::llround(before_s_ * 1e3), *author, timeout_);
    if (!done) return done.error();
    Print(*done, context);
    return {};
  }

 private:
  static constexpr double kLatest_s = 1e12;

  static void Print(const CompactionSummary& done, const CommandContext& context) {
    if (context.is_json) {
      context.PrintJson({{"dropped", done.dropped},
                         {"bytes", done.bytes},
                         {"tiles_checked", done.tiles_checked},
                         {"horizon", done.horizon},
                         {"revision", done.revision}});
    } else {
      context.out << done.dropped << " keyframes dropped, " << BytesText(done.bytes) << ", "
                  << done.tiles_checked << " tiles checked; revision " << done.revision
                  << ", the oldest that can be read is " << done.horizon << '\n';
    }
  }

  double before_s_ = 0.0;
  AuthorFlag author_;
  std::chrono::milliseconds timeout_{3'600'000};
};

}  // namespace

std::unique_ptr<Command> MakeCompactCommand() {
  return std::make_unique<CompactCommand>();
}

}  // namespace atlas
