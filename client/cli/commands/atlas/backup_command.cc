// `atlas backup NAME`: a copy of the atlas in the daemon's folder for backups. `atlas backups`:
// those that are there.
#include <algorithm>

#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/author_flag.h"
#include "client/cli/commands/atlas/timeout_flag.h"
#include "client/cli/output/progress_bar.h"
#include "client/cli/output/text_table.h"

namespace atlas {
namespace {

class BackupCommand : public Command {
 public:
  std::string Name() const override { return "backup"; }
  std::string Summary() const override {
    return "Copy the atlas into the daemon's folder for backups, while it is in use";
  }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("NAME", "NAME", name_, "Of the file, without a path");
    author_.Declare(arguments);
    DeclareTimeout(arguments, timeout_);
  }

  Status Run(CommandContext& context) override {
    const Result<std::string> author = author_.Author("atlas-backup");
    if (!author) return author.error();
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const auto done = WithProgress(*client, *author, context);
    if (!done) return done.error();
    if (context.is_json) {
      context.PrintJson({{"name", name_},
                         {"bytes", done->bytes},
                         {"revision", done->revision},
                         {"keyframes", done->keyframes},
                         {"tiles", done->tiles},
                         {"digest", HexText(done->sha256)}});
    } else {
      context.out << HexText(done->sha256) << "  " << done->tiles << " tiles, " << done->keyframes
                  << " keyframes, revision " << done->revision << ", " << BytesText(done->bytes)
                  << '\n';
    }
    return {};
  }

 private:
  Result<BackupSummary> WithProgress(AtlasClient& client,
                                     const std::string& author,
                                     const CommandContext& context) const {
    constexpr std::size_t kWhole = 1'000;  // of each bar
    ProgressBar copying(context.err, context.is_err_terminal, "copying", kWhole);
    ProgressBar reading(context.err, context.is_err_terminal, "reading back", kWhole);
    return client.Backup(name_, author, timeout_, [&](const BackupStage& stage) {
      const std::uint64_t total = std::max<std::uint64_t>(stage.total_bytes, 1);
      const double part = static_cast<double>(stage.done_bytes) / static_cast<double>(total);
      (stage.is_copied ? reading : copying).Update(static_cast<std::size_t>(part * kWhole));
    });
  }

  std::string name_;
  AuthorFlag author_;
  std::chrono::milliseconds timeout_{3'600'000};
};

class BackupsCommand : public Command {
 public:
  std::string Name() const override { return "backups"; }
  std::string Summary() const override { return "What is in the daemon's folder for backups"; }
  void Declare(ArgumentSet& /*arguments*/) override {}

  Status Run(CommandContext& context) override {
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const auto backups = client->ListBackups();
    if (!backups) return backups.error();
    TextTable table({"name", ">bytes", "written"});
    boost::json::array array;
    for (const BackupFile& backup : *backups) {
      array.push_back(boost::json::object{
          {"name", backup.name}, {"bytes", backup.bytes}, {"time_ms", backup.time_ms}});
      table.Row({backup.name, std::to_string(backup.bytes),
                 UtcText(static_cast<std::uint32_t>(backup.time_ms / 1'000))});
    }
    if (context.is_json) {
      context.PrintJson({{"backups", std::move(array)}});
    } else {
      table.Print(context.out);
    }
    return {};
  }
};

}  // namespace

std::unique_ptr<Command> MakeBackupCommand() {
  return std::make_unique<BackupCommand>();
}

std::unique_ptr<Command> MakeBackupsCommand() {
  return std::make_unique<BackupsCommand>();
}

}  // namespace atlas
