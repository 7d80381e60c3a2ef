#include "core/alignment/session_cut.h"

#include <algorithm>
#include <cmath>

namespace atlas {
namespace {

double StepTo(std::span<const Pose> poses, std::size_t i) {
  return (poses[i].translation() - poses[i - 1].translation()).norm();
}

// The keyframes of a part without a jump, in submaps of equal way.
void CutPart(std::span<const Pose> poses,
             std::size_t begin,
             std::size_t end,
             const CutOptions& options,
             std::vector<SubmapCut>& cuts) {
  double way_m = 0.0;
  for (std::size_t i = begin + 1; i < end; ++i) {
    way_m += StepTo(poses, i);
  }
  const double submaps = std::max(1.0, std::round(way_m / options.length_m));
  double number = 1.0;  // of the submap, the first one's; the last one ends with the part
  const auto is_past_end = [&](double at_m) {
    return number < submaps && at_m > way_m * number / submaps;
  };
  SubmapCut cut{begin, begin, begin > 0};
  double at_m = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    if (i > begin) at_m += StepTo(poses, i);
    const bool is_full = cut.end - cut.begin == options.max_keyframes;
    if (cut.end > cut.begin && (is_past_end(at_m) || is_full)) {
      cuts.push_back(cut);
      cut = {i, i, false};
      while (is_past_end(at_m)) ++number;
    }
    cut.end = i + 1;
  }
  cuts.push_back(cut);
}

}  // namespace

std::vector<SubmapCut> CutSession(std::span<const Pose> T_world_sensor, const CutOptions& options) {
  std::vector<SubmapCut> cuts;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= T_world_sensor.size(); ++i) {
    if (i < T_world_sensor.size() && StepTo(T_world_sensor, i) <= options.jump_m) {
      continue;
    }
    CutPart(T_world_sensor, begin, i, options, cuts);
    begin = i;
  }
  return cuts;
}

}  // namespace atlas
