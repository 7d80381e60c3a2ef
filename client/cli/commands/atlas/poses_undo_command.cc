// `atlas poses undo BATCH`: what a batch changed is as it was before it.
#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/author_flag.h"
#include "client/cli/commands/atlas/pose_batch_text.h"

namespace atlas {
namespace {

class PosesUndoCommand : public Command {
 public:
  std::string Name() const override { return "poses undo"; }
  std::string Summary() const override {
    return "Undo a batch of corrections, and what it published, by another batch";
  }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("BATCH", "BATCH", batch_, "Its number, as `atlas log` has it");
    author_.Declare(arguments);
  }

  Status Run(CommandContext& context) override {
    const Result<std::string> author = author_.Author("atlas-poses-undo");
    if (!author) return author.error();
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const Result<PoseBatchSummary> done = client->UndoPoses(batch_, *author);
    if (!done) return done.error();
    PrintPoseBatch(*done, context);
    return {};
  }

 private:
  std::uint64_t batch_ = 0;
  AuthorFlag author_;
};

}  // namespace

std::unique_ptr<Command> MakePosesUndoCommand() {
  return std::make_unique<PosesUndoCommand>();
}

}  // namespace atlas
