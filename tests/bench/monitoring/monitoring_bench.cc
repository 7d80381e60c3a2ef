// A drive tracked in a map that was damaged on purpose, and in the map as it was: errors, and the
// contradictions reported against those made. Lines of JSON.
//
// Usage: monitoring_bench MAP_DRIVE all|even|odd TRACKED_DRIVE all|even|odd RINGS [DAMAGE...]
// DAMAGE: none, columns, cars, building, all.
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "client/drive/drive_localization.h"
#include "core/scan/range_image.h"
#include "core/scan/scan_reader.h"
#include "tests/bench/localization/fused_drive.h"
#include "tests/bench/monitoring/change_score.h"
#include "tests/bench/monitoring/damaged_map.h"

namespace atlas::testing {
namespace {

struct Tracked {
  DriveLocalizationReport report;
  std::vector<Contradiction> contradictions;
  std::size_t lost = 0;
  double monitor_ms = 0.0;
};

Result<DamageOptions> DamageNamed(const std::string& name) {
  DamageOptions options;
  const bool is_all = name == "all";
  if (!is_all && name != "none" && name != "columns" && name != "cars" && name != "building") {
    return Error(StatusCode::kInvalidArgument, "no damage is called " + name);
  }
  options.column_share = is_all || name == "columns" ? 0.3 : 0.0;
  options.cars = is_all || name == "cars" ? 8 : 0;
  options.is_building_gone = is_all || name == "building";
  return options;
}

class Bench {
 public:
  Bench(DriveFolder mapped, DriveFolder tracked, std::uint32_t rings)
      : mapped_(std::move(mapped)), tracked_(std::move(tracked)), rings_(rings) {}

  Status Run(const SelectionOptions& of_map,
             const SelectionOptions& of_track,
             const std::vector<std::string>& damages) {
    SurveyOptions survey_options;
    survey_options.rings = rings_;
    const auto survey = SurveyDrive(mapped_, survey_options);
    if (!survey) return survey.error();
    auto map = FusedDrive::Fuse(mapped_, *survey, {MapProfile(), of_map, kMapRange_m});
    if (!map) return map.error();
    selection_ = of_track;
    std::vector<Eigen::Vector3d> way;
    for (const SelectedScan& scan : SelectScans(tracked_, of_track)) {
      way.push_back(tracked_.scans[scan.index].T_world_sensor.translation());
    }
    for (const std::string& name : damages) {
      const auto options = DamageNamed(name);
      if (!options) return options.error();
      auto damaged = DamagedMap::Make(*map, way, *options);
      if (!damaged) return damaged.error();
      ATLAS_RETURN_IF_ERROR(RunOne(name, *damaged));
    }
    return {};
  }

 private:
  static constexpr double kMapRange_m = 40.0;

  Result<Tracked> Track(MapSource& map) {
    Tracked tracked;
    MapView view(map);
    DriveMonitor monitor(view, options_,
                         [&](const Contradiction& c) { tracked.contradictions.push_back(c); });
    DriveLocalizationOptions options;
    options.selection = selection_;
    options.rings = rings_;
    options.monitor = &monitor;
    const auto report = LocalizeDrive(tracked_, options, view, [&](const LocalizedScan& scan) {
      tracked.lost += scan.located.health == LocalizationHealth::kLost ? 1 : 0;
    });
    if (!report) return Error(report.error());
    monitor.Finish();
    tracked.report = *report;
    tracked.monitor_ms = 1e3 * monitor.cpu_s() / static_cast<double>(report->scans);
    return tracked;
  }

  Result<ChangesSeen> See(const DamagedMap& map) {
    SurveyOptions survey_options;
    survey_options.rings = rings_;
    const auto survey = SurveySensor(tracked_, survey_options);
    if (!survey) return Error(survey.error());
    ChangesSeen seen(map.changes(), map.profile(), static_cast<double>(options_.sight.min_range_m),
                     static_cast<double>(options_.sight.max_range_m));
    for (const SelectedScan& selected : SelectScans(tracked_, selection_)) {
      const DriveScan& scan = tracked_.scans[selected.index];
      const auto cloud = ReadScan(scan.scan);
      if (!cloud) return Error(cloud.error());
      const RangeImage image = MakeRangeImage(*cloud, survey->layout, survey->ring_step);
      std::vector<Eigen::Vector3d> returns;
      for (std::size_t i = 0; i < image.size(); ++i) {
        returns.push_back(scan.T_world_sensor *
                          Eigen::Vector3f(image.x[i], image.y[i], image.z[i]).cast<double>());
      }
      seen.Add(scan.T_world_sensor.translation(), returns);
    }
    return seen;
  }

  Status RunOne(const std::string& name, DamagedMap& map) {
    const auto tracked = Track(map);
    if (!tracked) return tracked.error();
    const auto seen = See(map);
    if (!seen) return seen.error();
    for (const std::uint32_t min_scans : {1U, 3U, 6U}) {
      Print(name, min_scans, *tracked, map,
            ScoreChanges(tracked->contradictions, map.changes(), *seen, min_scans, map.profile()));
    }
    return {};
  }

  void Print(const std::string& name,
             std::uint32_t min_scans,
             const Tracked& tracked,
             const DamagedMap& map,
             const ChangeScore& score) const {
    const LocalizationScore& errors = tracked.report.score;
    std::cout << "{\"damage\": \"" << name << "\", \"min_scans\": " << min_scans
              << ", \"scans\": " << tracked.report.scans << ", \"lost\": " << tracked.lost
              << ", \"failures\": " << errors.failures()
              << ", \"rmse_m\": " << errors.translation_rmse_m()
              << ", \"rmse_deg\": " << errors.rotation_rmse_deg()
              << ", \"ms_per_scan\": " << 1e3 / tracked.report.hz()
              << ", \"monitor_ms\": " << tracked.monitor_ms
              << ", \"changed_cells\": " << map.changes().cells.size()
              << ", \"cars_gone\": " << map.cars_gone() << ", \"cars_put\": " << map.cars_put();
    for (std::size_t kind = 0; kind < 3; ++kind) {
      std::cout << ", \"" << ContradictionKindName(static_cast<ContradictionKind>(kind)) << "\": ["
                << score.right[kind] << ", " << score.reported[kind] << "]";
    }
    std::cout << ", \"found\": {";
    for (std::size_t kind = 0; kind < 2; ++kind) {
      for (std::size_t part = 0; part < kChangePartNames.size(); ++part) {
        const Found& found = score.recall[kind][part];
        std::cout << (kind + part == 0 ? "" : ", ") << "\""
                  << ContradictionKindName(static_cast<ContradictionKind>(kind)) << ' '
                  << kChangePartNames[part] << "\": [" << found.found << ", " << found.cells << "]";
      }
    }
    std::cout << "}, \"exact\": [" << score.exact.found << ", " << score.exact.cells << "]}"
              << std::endl;
  }

  DriveFolder mapped_;
  DriveFolder tracked_;
  std::uint32_t rings_;
  SelectionOptions selection_;
  MonitorOptions options_;
};

Status Main(int argc, char** argv) {
  if (argc < 6) {
    return {StatusCode::kInvalidArgument,
            "usage: monitoring_bench MAP_DRIVE all|even|odd TRACKED_DRIVE all|even|odd RINGS "
            "[DAMAGE...]"};
  }
  auto mapped = OpenDriveFolder(argv[1]);
  if (!mapped) return mapped.error();
  auto tracked = OpenDriveFolder(argv[3]);
  if (!tracked) return tracked.error();
  const auto of_map = ParseScanParity(argv[2]);
  if (!of_map) return of_map.error();
  const auto of_track = ParseScanParity(argv[4]);
  if (!of_track) return of_track.error();
  SelectionOptions map_selection;
  map_selection.parity = *of_map;
  SelectionOptions track_selection;
  track_selection.parity = *of_track;
  Bench bench(*std::move(mapped), *std::move(tracked),
              static_cast<std::uint32_t>(std::atoi(argv[5])));
  return bench.Run(map_selection, track_selection, std::vector<std::string>(argv + 6, argv + argc));
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  const atlas::Status status = atlas::testing::Main(argc, argv);
  if (!status.ok()) std::cerr << "monitoring_bench: " << status.message() << '\n';
  return status.ok() ? 0 : 1;
}
