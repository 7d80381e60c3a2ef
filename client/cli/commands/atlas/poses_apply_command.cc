// `atlas poses apply FILE`: a batch of pose corrections, all or nothing; on a condition, and with
// staged sessions that it publishes.
#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/author_flag.h"
#include "client/cli/commands/atlas/pose_batch_text.h"
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
    arguments.Optional("--if-revision", "R", if_revision_,
                       "Only if nothing changed of these sessions since that revision");
    arguments.Repeated("--publish", "VEHICLE/SESSION", terms_.published,
                       "Put this staged session into the map by the same step; may be repeated");
    author_.Declare(arguments);
  }

  Status Run(CommandContext& context) override {
    if (if_revision_ == std::optional<std::uint64_t>(0)) {
      return {StatusCode::kInvalidArgument, "--if-revision 0: expected a revision from 1 on"};
    }
    terms_.if_revision = if_revision_.value_or(0);
    const Result<std::string> text = ReadWholeFile(file_, kMaxFileBytes);
    if (!text) return text.error();
    const auto corrections = ParsePoseFile(*text);
    if (!corrections) return corrections.error().WithContext(file_);
    const Result<std::string> author = author_.Author("atlas-poses-apply");
    if (!author) return author.error();
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const Result<PoseBatchSummary> done = client->UpdatePoses(*corrections, *author, terms_);
    if (!done) return done.error();
    PrintPoseBatch(*done, context);
    return {};
  }

 private:
  std::string file_;
  std::optional<std::uint64_t> if_revision_;
  BatchTerms terms_;
  AuthorFlag author_;
};

}  // namespace

std::unique_ptr<Command> MakePosesApplyCommand() {
  return std::make_unique<PosesApplyCommand>();
}

}  // namespace atlas
