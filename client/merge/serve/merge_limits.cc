#include "client/merge/serve/merge_limits.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/str_cat.h"
#include "core/geometry/pose.h"

namespace atlas {
namespace {

constexpr double kDegree = 180.0 / std::numbers::pi;

struct LargestMove {
  double move_m = 0.0;
  double turn_rad = 0.0;
};

LargestMove LargestMoveOf(const MergeSession& session, const SessionOutcome& outcome) {
  LargestMove largest;
  for (const MovedKeyframe& moved : outcome.moved) {
    const Pose before = session.keyframes[moved.keyframe].T_world_sensor.ToPose();
    const Pose step = before.inverse() * moved.T_world_sensor.ToPose();
    largest.move_m = std::max(largest.move_m, step.translation().norm());
    largest.turn_rad = std::max(largest.turn_rad, Eigen::AngleAxisd(step.linear()).angle());
  }
  return largest;
}

// To the millimetre or thousandth of a degree: nobody reads more.
double Rounded3(double value) {
  return std::round(1e3 * value) / 1e3;
}

std::optional<std::string> BreachOf(const MergeSession& session,
                                    const SessionOutcome& outcome,
                                    const MergeLimits& limits) {
  const LargestMove largest = LargestMoveOf(session, outcome);
  const char* const kind = session.is_staged ? "staged session " : "session ";
  const double max_move_m = session.is_staged ? limits.max_staged_move_m : limits.max_move_m;
  if (largest.move_m > max_move_m) {
    return StrCat(kind, session.key, " would move by ", Rounded3(largest.move_m), " m, at most ",
                  max_move_m);
  }
  if (!session.is_staged && largest.turn_rad > limits.max_turn_rad) {
    return StrCat(kind, session.key, " would turn by ", Rounded3(kDegree * largest.turn_rad),
                  " degrees, at most ", kDegree * limits.max_turn_rad);
  }
  return std::nullopt;
}

}  // namespace

Status MergeLimits::Validate() const {
  for (const auto& [name, value] : {std::pair<const char*, double>{"max_move_m", max_move_m},
                                    {"max_turn_rad", max_turn_rad},
                                    {"max_staged_move_m", max_staged_move_m}}) {
    if (!(value >= 0.0)) {  // NaN, too
      return {StatusCode::kInvalidArgument, StrCat(name, ": ", value, ", expected at least 0")};
    }
  }
  return {};
}

std::vector<LimitBreach> CheckLimits(const MergeRun& run, const MergeLimits& limits) {
  std::vector<LimitBreach> breaches;
  for (std::size_t i = 0; i < run.sessions.size(); ++i) {
    if (auto what = BreachOf(run.sessions[i], run.plan.sessions[i], limits)) {
      breaches.push_back({{run.sessions[i].key}, *std::move(what)});
    }
  }
  if (run.plan.tiles.size() > limits.max_tiles) {
    breaches.push_back(
        {{}, StrCat(run.plan.tiles.size(), " tiles would change, at most ", limits.max_tiles)});
  }
  return breaches;
}

}  // namespace atlas
