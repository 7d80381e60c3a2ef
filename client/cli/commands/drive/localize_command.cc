// `atlas localize DIR`: where a drive's scans lie in the map, scored against the drive's poses.
#include <filesystem>
#include <functional>
#include <numbers>

#include "client/cli/commands/drive/contradiction_output.h"
#include "client/cli/commands/drive/drive_commands.h"
#include "client/cli/commands/drive/drive_flags.h"
#include "client/cli/commands/drive/localization_text.h"
#include "client/cli/commands/drive/relocalization_text.h"
#include "client/cli/commands/drive/track_output.h"
#include "client/cli/map_input/opened_map.h"
#include "client/cli/output/progress_bar.h"
#include "client/cli/output/text_table.h"
#include "client/drive/drive_localization.h"
#include "client/drive/drive_relocalization.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

class LocalizeCommand : public Command {
 public:
  std::string Name() const override { return "localize"; }
  std::string Summary() const override {
    return "Find a drive's scans in the map, score the poses";
  }
  bool ReadsAtlasFiles() const override { return true; }

  void Declare(ArgumentSet& arguments) override {
    drive_.Declare(arguments, "velodyne/NNNNNN.bin, poses.txt");
    drive_.DeclareScans(arguments);
    arguments.Optional(
        "--max-range", "M", options_.max_range_m,
        "Reach of what is matched [100; paper: 40]; below 20 no scan is called good");
    arguments.Optional("--perturb", "T_M,R_DEG", perturbation_,
                       "Single shots from starts up to so far off (10 m), as they are told to be; "
                       "else the drive is tracked");
    arguments.Optional("--trials", "N", trials_, "Single shots a scan [10]");
    arguments.Optional("--seed", "K", options_.seed, "Of the disturbances [0]");
    arguments.Flag("--no-restart", no_restart_, "After a jump it has to find itself");
    arguments.Flag("--relocalize", relocalize_, "Find each scan alone, with no start");
    arguments.Optional("--prior-radius", "M", prior_radius_m_,
                       "The position of each scan with --relocalize, else that of the start, is "
                       "given and right to so much");
    arguments.Optional("--prior-height", "M", prior_height_m_,
                       "The same of the height: no other deck counts");
    drive_.DeclareDeskew(
        arguments,
        "Undo the predicted motion during a scan; auto: where drives are skewed; on: always, which "
        "spoils scans that are not");
    arguments.Choice("--mode", {"atlas", "paper"}, mode_,
                     "How scans are matched; paper: its encode, decode and ICP, to compare with");
    track_.Declare(arguments);
    contradictions_.Declare(arguments);
  }

  Status Run(CommandContext& context) override {
    ATLAS_RETURN_IF_ERROR(CompleteOptions());
    const Result<DriveFolder> drive = OpenDriveFolder(drive_.directory());
    if (!drive) return drive.error();
    const Result<OpenedMap> map = OpenedMap::Open(context);
    if (!map) return map.error();
    ATLAS_RETURN_IF_ERROR(map->CheckHasTiles());
    if (relocalize_) return Relocalize(*drive, map->source(), context);
    MapView view(map->source());
    DriveMonitor monitor(view, {}, [this](const Contradiction& c) { contradictions_.Add(c); });
    if (contradictions_.is_wanted()) options_.monitor = &monitor;
    const auto report = Localize(*drive, view, context);
    monitor.Finish();
    const auto write = [&]() -> Status {
      ATLAS_RETURN_IF_ERROR(track_.Write(Title(*drive)));
      return contradictions_.Write(map->profile().cell_size_m());
    };
    if (!report) return Broken(report.error(), write);
    ATLAS_RETURN_IF_ERROR(write());
    ATLAS_RETURN_IF_ERROR(CheckReadable(*report));
    PrintReport(*report, monitor, map->bytes_received(), context);
    NoteLost(*report, !perturbation_, context.err);
    return {};
  }

 private:
  Status CompleteOptions() {
    const Result<ScanParity> parity = drive_.parity();
    if (!parity) return parity.error();
    options_.rings = drive_.rings();
    options_.mode = mode_ == "paper" ? LocalizationMode::kPaper : LocalizationMode::kAtlas;
    options_.selection.parity = *parity;
    const Result<DeskewOptions> deskew = drive_.deskew();
    if (!deskew) return deskew.error();
    options_.deskew = *deskew;
    if (trials_ && !perturbation_) {
      return {StatusCode::kInvalidArgument, "--trials needs --perturb"};
    }
    if (no_restart_ && perturbation_) {
      return {StatusCode::kInvalidArgument, "--no-restart is of a drive: without --perturb"};
    }
    options_.is_restarted = !no_restart_;
    CompleteStart();
    if (contradictions_.is_wanted() && (relocalize_ || perturbation_ || mode_ != "atlas")) {
      return {StatusCode::kInvalidArgument,
              "--contradictions needs a drive that is tracked: without --relocalize, --perturb and "
              "--mode paper"};
    }
    ATLAS_RETURN_IF_ERROR(contradictions_.Check());
    if (relocalize_ && (perturbation_ || no_restart_ || mode_ != "atlas" ||
                        options_.deskew.deskewing != Deskewing::kOff)) {
      return {StatusCode::kInvalidArgument,
              "--relocalize takes no start and no track: without --perturb, --no-restart, --mode "
              "paper and --deskew"};
    }
    if (perturbation_) {
      options_.shots = {perturbation_->translation_m,
                        perturbation_->rotation_deg * std::numbers::pi / 180.0,
                        trials_.value_or(10)};
    }
    ATLAS_RETURN_IF_ERROR(track_.Check(Kind()));
    return relocalize_ ? RelocalizationOptions().Validate() : options_.Validate();
  }

  void CompleteStart() {
    if (relocalize_ || (!prior_radius_m_ && !prior_height_m_)) return;
    auto& start = options_.start.emplace();
    start.radius_m = prior_radius_m_.value_or(start.radius_m);
    start.height_m = prior_height_m_.value_or(start.height_m);
  }

  LocalizationKind Kind() const {
    if (relocalize_) return LocalizationKind::kRelocalized;
    return perturbation_ ? LocalizationKind::kSingleShots : LocalizationKind::kTracked;
  }

  // A daemon may go away hours later: what was found until then is kept.
  Status Broken(const Status& why, const std::function<Status()>& write) const {
    if (track_.lines() == 0) return why;
    const Status written = write();
    if (!written.ok()) return why.WithContext(written.message());
    return track_.is_wanted() ? why.WithContext(track_.Told()) : why;
  }

  void PrintReport(const DriveLocalizationReport& report,
                   const DriveMonitor& monitor,
                   std::uint64_t bytes_received,
                   const CommandContext& context) const {
    if (context.is_json) {
      boost::json::object summary = LocalizationJson(report, bytes_received);
      if (contradictions_.is_wanted()) summary["contradictions"] = contradictions_.Json(monitor);
      context.PrintJson(summary);
      return;
    }
    PrintLocalization(report, bytes_received, context.out);
    if (contradictions_.is_wanted()) {
      FactList facts;
      facts.Add("contradictions", contradictions_.Text(monitor));
      facts.Print(context.out);
    }
  }

  // Of the picture: the folder's own name.
  std::string Title(const DriveFolder& drive) const {
    const std::filesystem::path folder = std::filesystem::absolute(drive.path).lexically_normal();
    return StrCat((folder / ".").parent_path().filename().string(), ", mode ", mode_);
  }

  static ProgressBar MakeBar(const DriveFolder& drive,
                             const std::string& label,
                             const CommandContext& context) {
    // Lines of a stream would run into the bar on the same terminal.
    const bool is_stream_seen = context.is_json && context.is_out_terminal;
    return {context.err, context.is_err_terminal && !is_stream_seen, label,
            drive.scans.back().number - drive.scans.front().number + 1};
  }

  Result<DriveLocalizationReport> Localize(const DriveFolder& drive,
                                           MapView& view,
                                           const CommandContext& context) {
    ProgressBar bar = MakeBar(drive, "localize", context);
    const std::uint32_t first = drive.scans.front().number;
    return LocalizeDrive(drive, options_, view, [&](const LocalizedScan& scan) {
      if (context.is_json) context.PrintJson(LocalizedScanJson(scan));
      track_.Add(scan);
      bar.Update(scan.scan - first + 1);
    });
  }

  DriveRelocalizationOptions RelocalizationOptions() const {
    DriveRelocalizationOptions options;
    options.selection = options_.selection;
    options.rings = options_.rings;
    options.max_range_m = options_.max_range_m.value_or(options.max_range_m);
    options.prior_radius_m = prior_radius_m_;
    options.prior_height_m = prior_height_m_;
    options.seed = options_.seed;
    return options;
  }

  Result<DriveRelocalizationReport> FindScans(const DriveFolder& drive,
                                              const DriveRelocalizationOptions& options,
                                              MapView& view,
                                              const CommandContext& context) {
    ProgressBar bar = MakeBar(drive, "relocalize", context);
    const std::uint32_t first = drive.scans.front().number;
    return RelocalizeDrive(drive, options, view, [&](const RelocalizedScan& scan) {
      if (context.is_json) context.PrintJson(RelocalizedScanJson(scan));
      track_.Add(scan);
      bar.Update(scan.scan - first + 1);
    });
  }

  Status Relocalize(const DriveFolder& drive, MapSource& source, const CommandContext& context) {
    const DriveRelocalizationOptions options = RelocalizationOptions();
    MapView view(source);
    const auto report = FindScans(drive, options, view, context);
    const auto write = [&] {
      return track_.Write(Title(drive));
    };
    if (!report) return Broken(report.error(), write);
    ATLAS_RETURN_IF_ERROR(write());
    ATLAS_RETURN_IF_ERROR(CheckReadable(*report));
    if (context.is_json) {
      context.PrintJson(RelocalizationJson(*report));
    } else {
      PrintRelocalization(*report, context.out);
    }
    NoteUnknown(*report, context.err);
    return {};
  }

  DriveFlags drive_;
  bool relocalize_ = false;
  bool no_restart_ = false;
  std::optional<double> prior_radius_m_;
  std::optional<double> prior_height_m_;
  TrackOutput track_;
  ContradictionOutput contradictions_;
  std::string mode_ = "atlas";
  std::optional<Perturbation> perturbation_;
  std::optional<std::uint32_t> trials_;
  DriveLocalizationOptions options_;
};

}  // namespace

std::unique_ptr<Command> MakeLocalizeCommand() {
  return std::make_unique<LocalizeCommand>();
}

}  // namespace atlas
