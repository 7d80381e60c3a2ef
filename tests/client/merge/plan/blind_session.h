// Sessions of vehicles that saw nothing: poses and submaps as a test wants them, nothing to match.
#pragma once

#include <string>
#include <vector>

#include "client/merge/plan/closure_search.h"
#include "client/merge/plan/merge_options.h"
#include "client/merge/plan/merge_session.h"

namespace atlas::testing {

// One for all of a test program, where nothing is asked of it twice with another answer.
MergeWork& SharedWork();

// Upright.
Pose At(double x_m, double y_m = 0.0, double z_m = 0.0, double yaw_rad = 0.0);

// `count` poses along x from `start` on, `step_m` apart.
std::vector<Pose> Straight(const Pose& start, std::size_t count, double step_m = 1.0);

// A keyframe a pose, all upright, each a quarter of a second after the one before; submaps as
// BuildSubmaps cuts them.
MergeSession BlindSession(const std::string& vehicle,
                          const std::vector<Pose>& T_world_sensor,
                          const MergeOptions& options = {});
MergeSession Staged(MergeSession session);

// Submap `b` where `T_a_b` has it, as a good match would say.
FoundClosure Found(const SubmapRef& a,
                   const SubmapRef& b,
                   const Pose& T_a_b,
                   double explained = 0.8);
// The same where the stored poses have it, moved by `off` in the frame of a.
FoundClosure FoundAsStored(const std::vector<MergeSession>& sessions,
                           const SubmapRef& a,
                           const SubmapRef& b,
                           const Pose& off = Pose::Identity());

// Translation and rotation of `pose` from `expected`, metres and radians.
double DistanceBetween(const Pose& pose, const Pose& expected);
double AngleBetween(const Pose& pose, const Pose& expected);

}  // namespace atlas::testing
