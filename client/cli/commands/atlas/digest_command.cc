// `atlas digest`: one number for the whole atlas; equal atlases, equal digests.
#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/timeout_flag.h"
#include "client/cli/output/text_table.h"

namespace atlas {
namespace {

class DigestCommand : public Command {
 public:
  std::string Name() const override { return "digest"; }
  std::string Summary() const override {
    return "SHA-256 over all tiles, once everything is fused";
  }

  void Declare(ArgumentSet& arguments) override {
    DeclareTimeout(arguments, timeout_);
    arguments.Optional("--at", "REVISION", at_revision_, "Of the atlas as it was at this revision");
  }

  Status Run(CommandContext& context) override {
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const Result<DigestSummary> digest = client->Digest(timeout_, at_revision_);
    if (!digest) return digest.error();
    if (context.is_json) {
      context.PrintJson({{"digest", HexText(digest->sha256)},
                         {"tiles", digest->tiles},
                         {"revision", digest->revision}});
    } else {
      context.out << HexText(digest->sha256) << "  " << digest->tiles << " tiles, revision "
                  << digest->revision << '\n';
    }
    return {};
  }

 private:
  std::chrono::milliseconds timeout_{600'000};
  std::optional<std::uint64_t> at_revision_;
};

}  // namespace

std::unique_ptr<Command> MakeDigestCommand() {
  return std::make_unique<DigestCommand>();
}

}  // namespace atlas
