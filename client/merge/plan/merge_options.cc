#include "client/merge/plan/merge_options.h"

#include <cmath>
#include <initializer_list>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

struct Number {
  const char* name;
  double value;
};

Status Refused(const Number& number, const char* expected) {
  return {StatusCode::kInvalidArgument,
          StrCat("merge: ", number.name, " is ", number.value, ", expected ", expected)};
}

Status CheckAboveZero(std::initializer_list<Number> numbers) {
  for (const Number& number : numbers) {
    if (!std::isfinite(number.value) || number.value <= 0.0) {
      return Refused(number, "a number above 0");
    }
  }
  return {};
}

Status CheckNotNegative(std::initializer_list<Number> numbers) {
  for (const Number& number : numbers) {
    if (!std::isfinite(number.value) || number.value < 0.0) {
      return Refused(number, "a number of at least 0");
    }
  }
  return {};
}

}  // namespace

// What is divided by, rooted or counted with has to be above 0.
Status MergeOptions::Validate() const {
  ATLAS_RETURN_IF_ERROR(
      CheckAboveZero({{"cut.length_m", cut.length_m},
                      {"cut.max_keyframes", static_cast<double>(cut.max_keyframes)},
                      {"cut.jump_m", cut.jump_m},
                      {"submaps.place_spacing_m", submaps.place_spacing_m},
                      {"submaps.block_m", submaps.block_m},
                      {"graph.robust_sigmas", graph.robust_sigmas},
                      {"graph.tilt_sigma_rad", graph.tilt_sigma_rad},
                      {"graph.max_iterations", static_cast<double>(graph.max_iterations)},
                      {"graph.threads", static_cast<double>(graph.threads)},
                      {"priors.min_priors", static_cast<double>(priors.min_priors)},
                      {"odometry_sigma_m", odometry_sigma_m},
                      {"odometry_sigma_rad", odometry_sigma_rad},
                      {"information_share", information_share},
                      {"match_sigma_m", match_sigma_m},
                      {"match_sigma_rad", match_sigma_rad},
                      {"probe_stride", static_cast<double>(probe_stride)},
                      {"min_closures", static_cast<double>(min_closures)},
                      {"held_m", held_m},
                      {"held_rad", held_rad},
                      {"workers", static_cast<double>(workers)}}));
  return CheckNotNegative({{"priors.together_s", priors.together_s},
                           {"priors.slack_m", priors.slack_m},
                           {"priors.held_slack_m", priors.held_slack_m},
                           {"priors.min_share", priors.min_share},
                           {"priors.min_spread", priors.min_spread},
                           {"priors.max_frame_shift_m", priors.max_frame_shift_m},
                           {"odometry_drift", odometry_drift},
                           {"odometry_yaw_rad_a_m", odometry_yaw_rad_a_m},
                           {"odometry_share", odometry_share},
                           {"min_loop_m", min_loop_m},
                           {"near_m", near_m},
                           {"near_height_m", near_height_m},
                           {"min_margin", min_margin},
                           {"guided_m", guided_m},
                           {"guided_height_m", guided_height_m},
                           {"contradicted_m", contradicted_m},
                           {"contradicted_rad", contradicted_rad},
                           {"known_shape.metres", known_shape.metres},
                           {"known_shape.rad", known_shape.rad},
                           {"refined_shape.metres", refined_shape.metres},
                           {"refined_shape.rad", refined_shape.rad},
                           {"max_surprise_m", max_surprise_m},
                           {"max_surprise_rad", max_surprise_rad},
                           {"max_height_surprise_m", max_height_surprise_m},
                           {"guided_rounds", static_cast<double>(guided_rounds)},
                           {"refinements", static_cast<double>(refinements)},
                           {"min_move_m", min_move_m},
                           {"min_move_rad", min_move_rad}});
}

}  // namespace atlas
