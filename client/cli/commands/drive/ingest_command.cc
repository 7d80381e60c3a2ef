// `atlas ingest DIR`: a recorded drive into the atlas.
#include <chrono>
#include <filesystem>

#include "client/cli/commands/drive/anchor_text.h"
#include "client/cli/commands/drive/deskew_text.h"
#include "client/cli/commands/drive/drive_commands.h"
#include "client/cli/commands/drive/drive_flags.h"
#include "client/cli/commands/drive/dropped_text.h"
#include "client/cli/commands/drive/session_text.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/progress_bar.h"
#include "client/cli/output/text_table.h"
#include "client/drive/drive_ingest.h"
#include "client/vehicle/atlas_link.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

double FrontendMsPerScan(const IngestReport& report) {
  return report.upload.totals.sent == 0
             ? 0.0
             : 1e3 * report.frontend_s / static_cast<double>(report.upload.totals.sent);
}

boost::json::object ReportJson(const IngestReport& report, bool has_positions, double wall_s) {
  boost::json::object json = {{"keyframes", report.keyframes},
                              {"empty_scans", report.empty_scans},
                              {"dropped_returns", report.dropped_returns},
                              {"acked", report.upload.totals.acked},
                              {"duplicates", report.upload.totals.duplicates},
                              {"sent_before", report.upload.sent_before},
                              {"reconnections", report.upload.reconnections},
                              {"metres", Rounded(report.metres, 3)},
                              {"bytes_sent", report.upload.totals.bytes_sent},
                              {"frontend_ms_per_scan", Rounded(FrontendMsPerScan(report), 3)},
                              {"sensor_height_m", Rounded(report.mount.height_m, 3)},
                              {"sensor_tilt_deg", Rounded(report.mount.TiltDeg(), 2)},
                              {"sessions", report.sessions},
                              {"impossible_steps", report.impossible_steps.size()},
                              {"wall_s", Rounded(wall_s, 3)}};
  if (has_positions) json["positions"] = report.positions;
  if (report.deskewing.skew) json["deskew"] = DeskewJson(report.deskewing);
  if (!report.anchors.empty()) json["anchors"] = AnchorsJson(report.anchors);
  return json;
}

void PrintReport(const IngestReport& report, bool has_positions, double wall_s, std::ostream& out) {
  FactList facts;
  facts.Add("keyframes", StrCat(report.keyframes, " along ", FixedText(report.metres, 1), " m, ",
                                report.sessions, " session(s)"));
  AddDropped(report.dropped_returns, facts);
  if (report.deskewing.skew) facts.Add("deskew", DeskewText(report.deskewing));
  for (const SessionAnchor& anchor : report.anchors) {
    facts.Add("anchor", AnchorText(anchor));
  }
  if (has_positions) {
    facts.Add("positions", StrCat("of ", report.positions, " keyframes"));
  }
  facts.Add("acknowledged", StrCat(report.upload.totals.acked, ", of them ",
                                   report.upload.totals.duplicates, " were there already"));
  if (report.upload.sent_before > 0) {
    facts.Add("resumed", StrCat("behind ", report.upload.sent_before,
                                " keyframes that an earlier run had sent"));
  }
  if (report.upload.reconnections > 0) {
    facts.Add("connection",
              StrCat("lost and made again ", report.upload.reconnections, " time(s)"));
  }
  facts.Add("sent", BytesText(report.upload.totals.bytes_sent));
  facts.Add("sensor", StrCat(FixedText(report.mount.height_m, 3), " m above the ground, tilted by ",
                             FixedText(report.mount.TiltDeg(), 1), " deg"));
  facts.Add("front end", FixedText(FrontendMsPerScan(report), 1) + " ms CPU a scan");
  facts.Add("time", FixedText(wall_s, 1) + " s");
  facts.Print(out);
}

class IngestCommand : public Command {
 public:
  std::string Name() const override { return "ingest"; }
  std::string Summary() const override {
    return "Make keyframes of a recorded drive and upload them";
  }

  void Declare(ArgumentSet& arguments) override {
    drive_.Declare(arguments, "velodyne/NNNNNN.bin, poses.txt, optional times.txt");
    arguments.Optional("--vehicle", "V", vehicle_, "Name of the vehicle [vehicle]");
    arguments.Optional("--session", "S", session_, "Name of the session [the folder's]");
    arguments.Optional("--every", "M", options_.selection.every_m,
                       "Metres between keyframes; 0 keeps all [1]");
    drive_.DeclareSelection(arguments, options_.max_range_m, "a keyframe");
    arguments.Optional("--range", "A:B", range_, "Scan numbers from A to before B");
    arguments.Optional("--shuffle", "SEED", options_.shuffle_seed, "Upload in another order");
    arguments.Optional("--batch", "N", batch_, "Keyframes on their way at a time [64]");
    arguments.Optional("--sensor-height", "M", options_.sensor_height_m,
                       "Above the ground [estimated]");
    drive_.DeclareDeskew(
        arguments, "Undo the vehicle's motion during a scan; auto: where that makes it sharper");
    arguments.Flag("--staged", options_.is_staged,
                   "Keep it out of the map until `atlas session publish`");
    arguments.Flag(
        "--anchor", is_anchored_,
        "The drive has a frame of its own: find it in the map first; staged if it is not");
    arguments.Optional("--prior", "X,Y", prior_m_, "With --anchor: where it begins, in the atlas");
    arguments.Optional("--prior-radius", "M", prior_radius_m_, "How far off that is at most");
    arguments.Optional("--prior-height", "Z,M", prior_height_m_,
                       "With --anchor: the sensor's height there, and how far off that is at most");
    arguments.Flag("--resume", is_resumed_,
                   "With --anchor: an earlier run accepted the drive and did not end; what is new "
                   "of its sessions is not looked at again");
    arguments.Optional("--positions", "FILE", positions_,
                       "Where the sensor was at scans, by GNSS, in the atlas's frame: lines SCAN X "
                       "Y Z RADIUS, metres");
    arguments.Optional("--start", "T", options_.start_s,
                       "Seconds added to the scans' times [0]: who drives later has the last word");
  }

  Status Run(CommandContext& context) override {
    ATLAS_RETURN_IF_ERROR(CompleteOptions());
    const auto start = std::chrono::steady_clock::now();
    const Result<DriveFolder> drive = OpenDriveFolder(drive_.directory());
    if (!drive) return drive.error();
    if (positions_) {
      Result<KnownPlaces> positions = ReadPositions(*positions_, *drive);
      if (!positions) return positions.error();
      options_.positions = *std::move(positions);
    }
    const Result<IngestReport> report = Ingest(*drive, context);
    if (!report) return report.error();
    if (report->keyframes == 0) {
      context.err << "note: none of the drive's " << drive->scans.size()
                  << " scans is selected (--range, --scans)\n";
    }
    if (report->empty_scans > 0) {
      context.err << "note: no return from beyond the vehicle in " << report->empty_scans << " of "
                  << report->keyframes << " scans\n";
    }
    PrintPositionNotes(*report, context.err);
    if (!report->impossible_steps.empty()) {
      context.err << "note: " << report->impossible_steps.size() << " steps look impossible ("
                  << report->impossible_steps.front()
                  << "): the daemon keeps their session out of the map unless it is released "
                     "(atlas session release)\n";
    }
    PrintSessionNotes(report->upload, context.err);
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    if (context.is_json) {
      boost::json::object json = ReportJson(*report, positions_.has_value(), wall.count());
      json["session_states"] = SessionStatesJson(report->upload);
      context.PrintJson(json);
    } else {
      PrintReport(*report, positions_.has_value(), wall.count(), context.out);
    }
    ATLAS_RETURN_IF_ERROR(CheckAnchored(report->anchors));
    return is_anchored_ ? CheckNotQuarantined(report->upload) : Status();
  }

 private:
  void PrintPositionNotes(const IngestReport& report, std::ostream& err) const {
    if (!positions_) return;
    if (report.positions == 0 && report.keyframes > 0) {
      err << "note: none of the " << report.keyframes << " keyframes has a position in "
          << *positions_ << '\n';
    }
    if (report.upload.totals.duplicates + report.upload.sent_before > 0) {
      err << "note: keyframes that were there already keep the positions that they came with, if "
             "any\n";
    }
  }

  Status CompleteOptions() {
    const Result<ScanParity> parity = drive_.parity();
    if (!parity) return parity.error();
    options_.rings = drive_.rings();
    options_.selection.parity = *parity;
    options_.selection.begin = range_.begin;
    options_.selection.end = range_.end;
    const Result<DeskewOptions> deskew = drive_.deskew();
    if (!deskew) return deskew.error();
    options_.deskew = *deskew;
    options_.upload.max_in_flight = batch_;
    options_.now_s =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    options_.session = {vehicle_, session_.value_or(FolderName())};
    ATLAS_RETURN_IF_ERROR(CompleteAnchor());
    return options_.Validate();
  }

  Status CompleteAnchor() {
    if (prior_m_.has_value() != prior_radius_m_.has_value()) {
      return {StatusCode::kInvalidArgument, "--prior and --prior-radius need each other"};
    }
    if (!is_anchored_) {
      return prior_m_ || prior_height_m_ || is_resumed_
                 ? Status(StatusCode::kInvalidArgument,
                          "--prior, --prior-height and --resume need --anchor")
                 : Status();
    }
    options_.anchor.emplace().is_rest_accepted = is_resumed_;
    PlacePrior& prior = options_.anchor->prior;
    if (prior_m_) {
      prior.center = *prior_m_;
      prior.radius_m = *prior_radius_m_;
    }
    if (prior_height_m_) {
      prior.z_m = prior_height_m_->x();
      prior.height_m = prior_height_m_->y();
    }
    return {};
  }

  std::string FolderName() const {
    std::error_code error;
    const std::filesystem::path given = drive_.directory();
    const std::filesystem::path absolute = std::filesystem::weakly_canonical(given, error);
    return NameFrom((error ? given : absolute).filename().string());
  }

  Result<IngestReport> Ingest(const DriveFolder& drive, const CommandContext& context) const {
    // Somebody waits: no attempt is left out for longer than this.
    AtlasLink link({.connection = context.connection, .max_delay = std::chrono::seconds(5)});
    ProgressBar bar(context.err, context.is_err_terminal, "ingest", drive.scans.size());
    return IngestDrive(drive, options_, link, [&](std::size_t done, std::size_t total) {
      bar.Update(done * drive.scans.size() / total);
    });
  }

  DriveFlags drive_;
  std::string vehicle_ = "vehicle";
  std::optional<std::string> session_;
  bool is_anchored_ = false;
  bool is_resumed_ = false;
  std::optional<Eigen::Vector2d> prior_m_;
  std::optional<double> prior_radius_m_;
  std::optional<Eigen::Vector2d> prior_height_m_;
  std::optional<std::string> positions_;
  NumberRange range_;
  std::uint32_t batch_ = 64;
  IngestOptions options_ = DefaultOptions();

  static IngestOptions DefaultOptions() {
    IngestOptions options;
    options.selection.every_m = 1.0;
    return options;
  }
};

}  // namespace

std::unique_ptr<Command> MakeIngestCommand() {
  return std::make_unique<IngestCommand>();
}

}  // namespace atlas
