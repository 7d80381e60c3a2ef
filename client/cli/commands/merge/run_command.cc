// `atlas-merge run`: finds where sessions belong and hands the daemon one batch of corrections.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/command_line/interruption.h"
#include "client/cli/commands/atlas/author_flag.h"
#include "client/cli/commands/merge/merge_commands.h"
#include "client/cli/commands/merge/merge_text.h"
#include "client/cli/files/change_file.h"
#include "client/cli/files/pose_file.h"
#include "client/cli/files/whole_file.h"
#include "client/cli/output/progress_bar.h"
#include "client/merge/change_report.h"
#include "client/merge/merge_run.h"
#include "client/merge/source/session_transfer.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

// A bar a step, and an end when a signal comes.
class Progress {
 public:
  explicit Progress(CommandContext& context) : context_(context) {}

  Status operator()(std::string_view step, std::size_t done, std::size_t all) {
    if (step != step_ || all != all_) {
      bar_.reset();
      step_ = step;
      all_ = all;
      bar_.emplace(context_.err, context_.is_err_terminal, step_, all);
    }
    bar_->Update(done);
    return interruption_.Check();
  }
  void Wipe() { bar_.reset(); }

 private:
  CommandContext& context_;
  Interruption interruption_;
  std::string step_;
  std::size_t all_ = 0;
  std::optional<ProgressBar> bar_;
};

constexpr std::uint64_t kMaxWorkBytes = 16ULL << 30U;

class MergeRunCommand : public Command {
 public:
  std::string Name() const override { return "run"; }
  std::string Summary() const override {
    return "Align sessions with each other, correct their poses and publish those that fit";
  }
  bool ReadsAtlasFiles() const override { return true; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Repeated("--session", "VEHICLE/SESSION", wanted_,
                       "A staged session to merge; may be repeated [all that are staged]");
    arguments.Repeated(
        "--from", "FILE", from_,
        "Bring the sessions of another atlas first, staged: its file, or HOST:PORT of "
        "its daemon; may be repeated");
    arguments.Flag("--dry-run", is_dry_run_,
                   "Print what would be done, and do nothing; so it is with --atlas, too");
    arguments.Optional("--picture", "FILE.png", picture_, "Draw the ways before and after");
    arguments.Optional("--corrections", "FILE", corrections_,
                       "Write the corrected poses as `atlas poses apply` reads them");
    arguments.Optional("--changes", "FILE.csv|.geojson", changes_,
                       "Write what the sessions that are published saw otherwise than those before "
                       "them: what appeared, what vanished");
    arguments.Optional("--changes-picture", "FILE.png", changes_picture_,
                       "Draw it: red appeared, blue vanished");
    arguments.Optional("--work", "DIR", work_,
                       "Keep what was found there: the next merge, and one that was ended, are "
                       "done with what is new [nothing is kept]");
    author_.Declare(arguments);
  }

  Status Run(CommandContext& context) override {
    const Result<std::string> author = author_.Author("atlas-merge");
    if (!author) return author.error();
    for (const auto& file : {picture_, corrections_, changes_, changes_picture_}) {
      if (file) ATLAS_RETURN_IF_ERROR(CheckPlace(*file));
    }
    if (changes_) {
      const auto format = ChangeFormatOf(*changes_);
      if (!format) return format.error();
    }
    if (!from_.empty() && (is_dry_run_ || context.atlas_file)) {
      return {StatusCode::kInvalidArgument,
              "--from brings sessions to a daemon, which neither --dry-run nor --atlas does"};
    }
    if (context.atlas_file) {
      Result<AtlasFile> file = AtlasFile::Open(*context.atlas_file);
      if (!file) return file.error();
      FileSessions source(*std::move(file), *context.atlas_file);
      return Merge(source, nullptr, *author, context);
    }
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    for (const std::string& from : from_) {
      ATLAS_RETURN_IF_ERROR(Bring(from, *client, context));
    }
    DaemonSessions source(*client);
    return Merge(source, &*client, *author, context);
  }

 private:
  // Without --from a merge that is ended has changed nothing; with it, what came stays staged.
  static Status Bring(const std::string& from, AtlasClient& client, CommandContext& context) {
    if (std::filesystem::exists(from)) {
      Result<AtlasFile> file = AtlasFile::Open(from);
      if (!file) return file.error();
      FileSessions source(*std::move(file), from);
      return Bring(source, client, context);
    }
    Result<Endpoint> endpoint = Endpoint::Parse(from);
    if (!endpoint) {
      return {StatusCode::kNotFound,
              StrCat("--from ", from, ": there is no such file, and it is no HOST:PORT")};
    }
    ConnectionOptions options = context.connection;
    options.endpoint = *std::move(endpoint);
    Result<AtlasClient> other = AtlasClient::Connect(options);
    if (!other) return other.error();
    DaemonSessions source(*other);
    return Bring(source, client, context);
  }
  static Status Bring(SessionSource& source, AtlasClient& client, CommandContext& context) {
    Progress progress(context);
    const auto report = TransferSessions(source, client, [&](std::size_t done, std::size_t all) {
      return progress("bringing", done, all);
    });
    progress.Wipe();
    if (!report) return report.error();
    for (const LeftOut& one : report->left_out) {
      context.err << "note: " << source.name() << ": " << one.key << " is not brought: " << one.why
                  << '\n';
    }
    context.err << "note: " << source.name() << ": " << report->sessions << " sessions, "
                << report->keyframes << " keyframes, of which " << report->duplicates
                << " were there already\n";
    return {};
  }

  // `client` is null where there is nobody to hand it to.
  Status Merge(SessionSource& source,
               AtlasClient* client,
               const std::string& author,
               CommandContext& context) {
    constexpr int kAttempts = 3;
    Result<MergeWork> work =
        work_ ? MergeWork::Open(*work_, kAlignmentRules, kMaxWorkBytes) : MergeWork::Temporary();
    if (!work) return work.error();
    const bool is_applied = client != nullptr && !is_dry_run_;
    Progress progress(context);
    for (int attempt = 1;; ++attempt) {
      const auto run = RunMerge(source, wanted_, options_, *work, std::ref(progress));
      progress.Wipe();
      if (!run) return run.error();
      ATLAS_RETURN_IF_ERROR(WriteFiles(*run));
      ATLAS_RETURN_IF_ERROR(WriteChanges(*run, progress));
      std::optional<PoseBatchSummary> batch;
      if (is_applied && !run->IsNothing()) {
        auto applied = ApplyMerge(*run, *client, author);
        if (!applied && applied.error().code() == StatusCode::kConflict && attempt < kAttempts) {
          context.err << "note: " << applied.error().message() << ": merged again\n";
          continue;
        }
        if (!applied) return NotApplied(applied.error());
        batch = *std::move(applied);
      }
      Print(*run, batch, is_applied, context);
      return {};
    }
  }

  static Status NotApplied(const Status& status) {
    const bool is_known =
        status.code() != StatusCode::kTimeout && status.code() != StatusCode::kUnavailable;
    return is_known ? status
                    : status.WithContext(
                          "whether the merge was applied is not known, and `atlas log` tells; to "
                          "merge again does no harm");
  }

  Status WriteFiles(const MergeRun& run) const {
    if (picture_) ATLAS_RETURN_IF_ERROR(WritePng(DrawMerge(run.Picture()), *picture_));
    if (corrections_) {
      ATLAS_RETURN_IF_ERROR(WriteTextFile(*corrections_, PoseFileText(run.Corrections())));
    }
    return {};
  }

  Status WriteChanges(const MergeRun& run, Progress& progress) const {
    if (!changes_ && !changes_picture_) return {};
    const auto report = ReportChanges(run, std::ref(progress));
    progress.Wipe();
    if (!report) return report.error();
    if (changes_) {
      const ChangeFormat format = *ChangeFormatOf(*changes_);
      ATLAS_RETURN_IF_ERROR(WriteTextFile(*changes_, ChangeText(format, report->changes)));
    }
    if (!changes_picture_ || !report->picture) return {};
    return WritePng(*report->picture, *changes_picture_);
  }

  static void Print(const MergeRun& run,
                    const std::optional<PoseBatchSummary>& batch,
                    bool is_applied,
                    const CommandContext& context) {
    if (context.is_json) {
      context.PrintJson(MergeJson(run, batch));
      return;
    }
    PrintMerge(run, context.out);
    if (batch) {
      context.out << "batch " << batch->batch << ": " << batch->updated << " poses corrected, "
                  << batch->tiles_marked << " tiles marked; undone by: atlas poses undo "
                  << batch->batch << '\n';
    } else {
      context.out << (is_applied ? "nothing to do\n" : "nothing was changed\n");
    }
  }

  std::vector<SessionKey> wanted_;
  std::vector<std::string> from_;
  bool is_dry_run_ = false;
  std::optional<std::string> picture_;
  std::optional<std::string> corrections_;
  std::optional<std::string> changes_;
  std::optional<std::string> changes_picture_;
  std::optional<std::string> work_;
  AuthorFlag author_;
  MergeOptions options_;
};

}  // namespace

std::unique_ptr<Command> MakeMergeRunCommand() {
  return std::make_unique<MergeRunCommand>();
}

}  // namespace atlas
