// What a localizer says of a scan.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/geometry/pose.h"
#include "core/localization/belief/map_cover.h"
#include "core/localization/registration/pose_prior.h"
#include "core/localization/registration/registration.h"

namespace atlas {

enum class LocalizationHealth : std::uint8_t {
  kGood,
  kWeak,  // one horizontal direction is not held by anything seen, or in two places; or it was
          // lost, and nothing has confirmed yet that this is the place
  kLost,  // the scan does not fit the map here: the pose is the predicted one
};
std::string_view LocalizationHealthName(LocalizationHealth health);

struct LocalizationResult {
  Pose T_world_sensor = Pose::Identity();
  LocalizationHealth health = LocalizationHealth::kLost;
  MapCover cover = MapCover::kNone;                    // anything but fine is never good
  PoseCovariance covariance = PoseCovariance::Zero();  // of the pose, all that is known considered
  RegistrationResult registration;
};

}  // namespace atlas
