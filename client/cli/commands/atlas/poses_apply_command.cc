// `atlas poses apply FILE`: a batch of pose corrections, all or nothing.
#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/author_flag.h"
#include "client/cli/files/pose_file.h"
#include "client/cli/files/whole_file.h"

namespace atlas {
namespace {

constexpr std::uint64_t kMaxFileBytes = std::uint64_t{256} << 20;

class PosesApplyCommand : public Command {
 public:
  std::string Name() const override { return "poses apply"; }
  std::string Summary() const override { return "Correct the poses of keyframes, all or nothing"; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("FILE", "FILE", file_,
                       "Lines: vehicle session sequence and 12 numbers (3x4, sensor to world)");
    author_.Declare(arguments);
  }

  Status Run(CommandContext& context) override {
    const Result<std::string> text = ReadWholeFile(file_, kMaxFileBytes);
    if (!text) return text.error();
    const auto corrections = ParsePoseFile(*text);
    if (!corrections) return corrections.error().WithContext(file_);
    const Result<std::string> author = author_.Author("atlas-poses-apply");
    if (!author) return author.error();
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const Result<PoseBatchSummary> done = client->UpdatePoses(*corrections, *author);
    if (!done) return done.error();
    Print(*done, context);
    return {};
  }

 private:
  static void Print(const PoseBatchSummary& done, const CommandContext& context) {
    if (context.is_json) {
      context.PrintJson({{"updated", done.updated},
                         {"tiles_marked", done.tiles_marked},
                         {"revision", done.revision},
                         {"batch", done.batch},
                         {"compacted", done.compacted}});
    } else {
      context.out << done.updated << " poses moved, " << done.tiles_marked
                  << " tiles to be fused again, revision " << done.revision << ", batch "
                  << done.batch << '\n';
      if (done.compacted > 0) {
        context.out << done.compacted << " of them were dropped by compactions: nothing to move\n";
      }
    }
  }

  std::string file_;
  AuthorFlag author_;
};

}  // namespace

std::unique_ptr<Command> MakePosesApplyCommand() {
  return std::make_unique<PosesApplyCommand>();
}

}  // namespace atlas
