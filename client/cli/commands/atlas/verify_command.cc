// `atlas verify`: is what is stored whole, and are the tiles what their keyframes make?
#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/author_flag.h"
#include "client/cli/commands/atlas/timeout_flag.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

boost::json::object VerifyJson(const VerifySummary& found) {
  boost::json::array findings(found.findings.begin(), found.findings.end());
  return {{"checked", found.checked},       {"damaged", found.damaged},
          {"mismatched", found.mismatched}, {"findings", std::move(findings)},
          {"restored", found.restored},     {"given_up", found.given_up},
          {"revision", found.revision}};
}

void PrintVerify(const VerifySummary& found, bool is_repair, std::ostream& out) {
  if (is_repair) {
    out << "repaired: " << found.restored << " restored, " << found.given_up
        << " keyframes given up; now ";
  }
  out << found.checked << " checked, " << found.damaged << " damaged, " << found.mismatched
      << " mismatched\n";
  for (const std::string& finding : found.findings) {
    out << "  " << finding << '\n';
  }
}

class VerifyCommand : public Command {
 public:
  std::string Name() const override { return "verify"; }
  std::string Summary() const override { return "Check what the daemon has stored"; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Flag("--rebuild", is_rebuild_,
                   "Also fuse every tile again from its keyframes and compare");
    arguments.Flag("--repair", is_repair_,
                   "Restore what is damaged; delete keyframes that nothing can restore");
    author_.Declare(arguments);
    DeclareTimeout(arguments, timeout_);
  }

  Status Run(CommandContext& context) override {
    const Result<std::string> author = author_.Author("atlas-verify");
    if (!author) return author.error();
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const Result<VerifySummary> found = is_repair_ ? client->Repair(is_rebuild_, *author, timeout_)
                                                   : client->Verify(is_rebuild_, timeout_);
    if (!found) return found.error();
    if (context.is_json) {
      context.PrintJson(VerifyJson(*found));
    } else {
      PrintVerify(*found, is_repair_, context.out);
    }
    if (found->damaged == 0 && found->mismatched == 0) return {};
    return {StatusCode::kInvalidData, StrCat("verify: ", found->damaged, " damaged and ",
                                             found->mismatched, " mismatched of ", found->checked)};
  }

 private:
  bool is_rebuild_ = false;
  bool is_repair_ = false;
  AuthorFlag author_;
  std::chrono::milliseconds timeout_{3'600'000};
};

}  // namespace

std::unique_ptr<Command> MakeVerifyCommand() {
  return std::make_unique<VerifyCommand>();
}

}  // namespace atlas
