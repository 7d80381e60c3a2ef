// `atlas-merge run`: finds where sessions belong and hands the daemon one batch of corrections.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/commands/atlas/author_flag.h"
#include "client/cli/commands/merge/merge_commands.h"
#include "client/cli/commands/merge/merge_json.h"
#include "client/cli/commands/merge/merge_progress.h"
#include "client/cli/commands/merge/merge_sources.h"
#include "client/cli/commands/merge/merge_text.h"
#include "client/cli/files/change_file.h"
#include "client/cli/files/pose_file.h"
#include "client/cli/files/whole_file.h"
#include "client/cli/output/text_table.h"
#include "client/merge/change_report.h"
#include "client/merge/merge_run.h"
#include "client/merge/output/new_atlas.h"
#include "client/merge/source/joined_sessions.h"
#include "client/merge/source/session_transfer.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

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
    arguments.Optional("--output", "FILE", output_,
                       "Make a new atlas of it, and leave all others as they are: of a copy of "
                       "--atlas, or of nothing but what is brought");
    arguments.Flag("--dry-run", is_dry_run_,
                   "Print what would be done, and do nothing; so it is with --atlas without "
                   "--output, too");
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
    ATLAS_RETURN_IF_ERROR(CheckFiles());
    MergeProgressBar progress(context);
    if (output_) return MergeIntoFile(*author, progress, context);
    if (is_dry_run_ || context.atlas_file) return LookOnly(*author, progress, context);
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    SessionTransfer transfer(*client, "the daemon");
    for (const std::string& from : from_) {
      auto source = OpenSessions(from, context);
      if (!source) return source.error();
      ATLAS_RETURN_IF_ERROR(Bring(**source, transfer, progress, context));
    }
    DaemonSessions source(*client);
    return MergeAndPrint(source, &*client, *author, progress, context);
  }

 private:
  struct Merged {
    MergeRun run;
    std::optional<PoseBatchSummary> batch;  // none: nothing was applied
    bool is_applied = false;                // as far as there was something
  };

  // Before much is done.
  Status CheckFiles() const {
    for (const auto& file : {picture_, corrections_, changes_, changes_picture_}) {
      if (file) ATLAS_RETURN_IF_ERROR(CheckPlace(*file));
    }
    for (const auto& [flag, file] :
         {std::pair{"--picture", &picture_}, {"--changes-picture", &changes_picture_}}) {
      if (*file && !(*file)->ends_with(".png")) {
        return {StatusCode::kInvalidArgument,
                StrCat(flag, " ", **file, ": expected a name that ends in .png")};
      }
    }
    if (!changes_) return {};
    const auto format = ChangeFormatOf(*changes_);
    return format ? Status() : format.error();
  }

  // Nobody is told of it: what would be brought is read from where it is.
  Status LookOnly(const std::string& author,
                  MergeProgressBar& progress,
                  CommandContext& context) const {
    auto sources = OpenAll(context);
    if (!sources) return sources.error();
    auto joined = JoinedSessions::Make(*std::move(sources));
    if (!joined) return joined.error();
    return MergeAndPrint(*joined, nullptr, author, progress, context);
  }

  // The map that is merged into first: the file's, or the daemon's.
  Result<std::vector<std::unique_ptr<SessionSource>>> OpenAll(CommandContext& context) const {
    std::vector<std::unique_ptr<SessionSource>> sources;
    if (context.atlas_file) {
      auto file = OpenFileSessions(*context.atlas_file);
      if (!file) return Error(file.error());
      sources.push_back(*std::move(file));
    } else if (!output_) {
      Result<AtlasClient> client = context.Connect();
      if (!client) return Error(client.error());
      sources.push_back(std::make_unique<ConnectedSessions>(
          std::make_unique<AtlasClient>(*std::move(client)), "the daemon"));
    }
    for (const std::string& from : from_) {
      auto source = OpenSessions(from, context);
      if (!source) return Error(source.error());
      sources.push_back(*std::move(source));
    }
    return sources;
  }

  // Ended before it is whole, there is no new file.
  Status MergeIntoFile(const std::string& author,
                       MergeProgressBar& progress,
                       CommandContext& context) const {
    if (is_dry_run_) {
      return {StatusCode::kInvalidArgument, "--output makes an atlas, which --dry-run does not"};
    }
    auto sources = OpenAll(context);
    if (!sources) return sources.error();
    if (sources->empty()) {
      return {StatusCode::kInvalidArgument,
              "--output: there is nothing to merge; expected --atlas, --from or both"};
    }
    NewAtlasPlan plan{*output_, std::nullopt, sources->front()->profile()};
    if (context.atlas_file) plan.base = *context.atlas_file;
    auto made = NewAtlas::Begin(plan, std::ref(progress));
    progress.Wipe();
    if (!made) return made.error();
    SessionTransfer transfer(made->client(), sources->front()->name());
    for (std::size_t i = context.atlas_file ? 1 : 0; i < sources->size(); ++i) {
      ATLAS_RETURN_IF_ERROR(Bring(*(*sources)[i], transfer, progress, context));
    }
    DaemonSessions source(made->client(), *output_);
    const auto merged = Merge(source, &made->client(), author, progress, context);
    if (!merged) return merged.error();
    const auto file = made->Finish(author, std::ref(progress));
    progress.Wipe();
    if (!file) return file.error();
    Print(*merged, *file, context);
    return CheckWanted(merged->run);
  }

  // Without --from a merge that is ended has changed nothing; with it, what came stays staged.
  static Status Bring(SessionSource& source,
                      SessionTransfer& transfer,
                      MergeProgressBar& progress,
                      CommandContext& context) {
    const auto report = transfer.Bring(
        source, [&](std::size_t done, std::size_t all) { return progress("bringing", done, all); });
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

  Status MergeAndPrint(SessionSource& source,
                       AtlasClient* client,
                       const std::string& author,
                       MergeProgressBar& progress,
                       CommandContext& context) const {
    const auto merged = Merge(source, client, author, progress, context);
    if (!merged) return merged.error();
    Print(*merged, std::nullopt, context);
    return CheckWanted(merged->run);
  }

  // What was asked for by name and is not in the map then: a failure, when all else is done.
  Status CheckWanted(const MergeRun& run) const {
    std::string text;
    for (const UnmergedSession& one : UnmergedOf(run, wanted_)) {
      text += StrCat(text.empty() ? "" : "; ", one.key, " is not merged: ", one.why);
    }
    return text.empty() ? Status() : Status(StatusCode::kInvalidData, text);
  }

  // `client` is null where there is nobody to hand it to.
  Result<Merged> Merge(SessionSource& source,
                       AtlasClient* client,
                       const std::string& author,
                       MergeProgressBar& progress,
                       CommandContext& context) const {
    constexpr int kAttempts = 3;
    Result<MergeWork> work =
        work_ ? MergeWork::Open(*work_, kAlignmentRules, kMaxWorkBytes) : MergeWork::Temporary();
    if (!work) return Error(work.error());
    for (int attempt = 1;; ++attempt) {
      auto run = RunMerge(source, wanted_, options_, *work, std::ref(progress));
      progress.Wipe();
      if (!run) return Error(run.error());
      Status written = WriteFiles(*run);
      if (written.ok()) written = WriteChanges(*run, progress, context);
      if (!written.ok()) return Error(std::move(written));
      if (client == nullptr || run->IsNothing()) {
        return Merged{*std::move(run), std::nullopt, client != nullptr};
      }
      auto batch = ApplyMerge(*run, *client, author);
      if (batch) return Merged{*std::move(run), *std::move(batch), true};
      if (batch.error().code() != StatusCode::kConflict || attempt == kAttempts) {
        return Error(NotApplied(batch.error()));
      }
      context.err << "note: " << batch.error().message() << ": merged again\n";
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

  Status WriteChanges(const MergeRun& run,
                      MergeProgressBar& progress,
                      CommandContext& context) const {
    if (!changes_ && !changes_picture_) return {};
    const auto report = ReportChanges(run, std::ref(progress));
    progress.Wipe();
    if (!report) return report.error();
    if (changes_) {
      const ChangeFormat format = *ChangeFormatOf(*changes_);
      ATLAS_RETURN_IF_ERROR(WriteTextFile(*changes_, ChangeText(format, report->changes)));
    }
    if (!changes_picture_) return {};
    if (report->picture) return WritePng(*report->picture, *changes_picture_);
    context.err << "note: no session is published, " << *changes_picture_ << " is not written\n";
    return {};
  }

  void Print(const Merged& merged,
             const std::optional<BackupSummary>& file,
             const CommandContext& context) const {
    if (context.is_json) {
      boost::json::object json = MergeJson(merged.run, merged.batch);
      if (file) {
        json["output"] = {{"file", *output_},
                          {"bytes", file->bytes},
                          {"keyframes", file->keyframes},
                          {"tiles", file->tiles},
                          {"digest", HexText(file->sha256)}};
      }
      context.PrintJson(json);
      return;
    }
    PrintMerge(merged.run, context.out);
    if (merged.batch) {
      const PoseBatchSummary& batch = *merged.batch;
      context.out << "batch " << batch.batch << ": " << batch.updated << " poses corrected, "
                  << batch.tiles_marked << " tiles marked; undone by: atlas poses undo "
                  << batch.batch << (file ? ", once a daemon serves the new file" : "") << '\n';
    } else {
      context.out << (merged.is_applied ? "nothing to do\n" : "nothing was changed\n");
    }
    if (file) {
      context.out << *output_ << ": " << file->keyframes << " keyframes, " << file->tiles
                  << " tiles, " << BytesText(file->bytes) << '\n';
    }
  }

  std::vector<SessionKey> wanted_;
  std::vector<std::string> from_;
  std::optional<std::string> output_;
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
