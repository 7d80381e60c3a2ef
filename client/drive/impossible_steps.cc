#include "client/drive/impossible_steps.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/geometry/plausibility.h"

namespace atlas {
namespace {

constexpr double kScanInterval_s = 0.1;  // where times.txt is missing

UploadedPlace PlaceOf(const DriveScan& scan) {
  const QuantizedPose pose = QuantizedPose::FromPose(scan.T_world_sensor);
  return {scan.number, std::llround(1e3 * ScanTime_s(scan)), pose.x_um, pose.y_um, pose.z_um};
}

// By index: whether the step to this scan is on an impossible way.
std::vector<bool> OnImpossibleWays(const std::vector<DriveScan>& scans) {
  std::vector<bool> on_way(scans.size(), false);
  UploadedTrack track({});
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const auto found = track.Add(PlaceOf(scans[i]));
    for (std::size_t step = i; found && scans[step].number != found->from; --step) {
      on_way[step] = true;
    }
  }
  return on_way;
}

// Where nothing tells the time: whether the step to this scan leads away, or back to where the
// drive goes on after a few scans as if it had never been away.
std::vector<bool> OnExcursions(const std::vector<DriveScan>& scans) {
  std::vector<bool> on_excursion(scans.size(), false);
  const auto goes_on = [&](std::size_t before, std::size_t back) {
    const double most_m = kSessionJump_m * static_cast<double>(back - before);
    return IsJump(scans[back - 1], scans[back]) && Distance(scans[before], scans[back]) <= most_m;
  };
  for (std::size_t i = 1; i < scans.size(); ++i) {
    if (!IsJump(scans[i - 1], scans[i])) {
      continue;
    }
    const std::size_t end = std::min(scans.size(), i + kMostJudgedSteps);
    for (std::size_t back = i + 1; back < end; ++back) {
      if (goes_on(i - 1, back)) {
        for (std::size_t step = i; step <= back; ++step) {
          on_excursion[step] = true;
        }
        break;
      }
    }
  }
  return on_excursion;
}

}  // namespace

double ScanTime_s(const DriveScan& scan) {
  return scan.time_s.value_or(kScanInterval_s * scan.number);
}

void JoinImpossibleParts(const DriveFolder& drive, std::vector<SelectedScan>& selected) {
  const std::vector<DriveScan>& scans = drive.scans;
  const bool is_timed =
      std::all_of(scans.begin(), scans.end(), [](const auto& scan) { return scan.time_s; });
  const std::vector<bool> on_way = is_timed ? OnImpossibleWays(scans) : OnExcursions(scans);
  std::vector<std::uint32_t> sessions{0, 1};  // by part
  for (std::size_t i = 1; i < scans.size(); ++i) {
    if (IsJump(scans[i - 1], scans[i])) {
      sessions.push_back(sessions.back() + (on_way[i] ? 0U : 1U));
    }
  }
  for (SelectedScan& scan : selected) {
    scan.session_part = sessions[scan.session_part];
  }
}

std::vector<std::string> FindImpossibleSteps(const DriveFolder& drive,
                                             const std::vector<SelectedScan>& selected) {
  std::vector<std::string> steps;
  UploadedTrack track({});
  std::uint32_t part = 0;
  for (const SelectedScan& scan : selected) {
    if (std::exchange(part, scan.session_part) != scan.session_part) {
      track.Break();
    }
    const UploadedPlace place = PlaceOf(drive.scans[scan.index]);
    if (auto found = track.Add(place)) {
      steps.push_back(std::move(found->reason));
      track.Break();
      track.Add(place);
    }
  }
  return steps;
}

}  // namespace atlas
