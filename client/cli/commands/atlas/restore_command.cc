// `atlas restore BACKUP --to FILE`: a backup as the atlas of a daemon that does not run.
#include "client/atlas_file/backup_restore.h"
#include "client/cli/command_line/interruption.h"
#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/restore_text.h"
#include "client/cli/output/progress_bar.h"

namespace atlas {
namespace {

class RestoreCommand : public Command {
 public:
  std::string Name() const override { return "restore"; }
  std::string Summary() const override {
    return "Put a backup in the place of a daemon's atlas; the daemon must not run";
  }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("BACKUP", "BACKUP", backup_, "The file of the backup");
    arguments.Required("--to", "FILE", target_, "The atlas.db of the daemon's data directory");
    arguments.Flag("--replace", replaces_,
                   "Also where there is an atlas: it is kept as FILE.replaced-N");
  }

  Status Run(CommandContext& context) override {
    const auto done = WithProgress(context);
    if (!done) return done.error();
    PrintRestore(*done, context);
    return {};
  }

 private:
  Result<RestoreSummary> WithProgress(const CommandContext& context) const {
    constexpr std::size_t kWhole = 1'000;
    const Interruption interruption;
    ProgressBar bar(context.err, context.is_err_terminal, "restoring", kWhole);
    RestorePlan plan{backup_, target_, replaces_, {}, {}};
    plan.check_stop = [&interruption] {
      return interruption.Check();
    };
    plan.on_progress = [&bar](std::uint64_t done, std::uint64_t total) {
      const double part = total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total);
      bar.Update(static_cast<std::size_t>(part * kWhole));
    };
    return RestoreBackup(plan);
  }

  std::string backup_;
  std::string target_;
  bool replaces_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeRestoreCommand() {
  return std::make_unique<RestoreCommand>();
}

}  // namespace atlas
