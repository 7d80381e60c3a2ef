// How well a scan says where it was taken.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/localization/belief/map_cover.h"
#include "core/localization/registration/registration.h"

namespace atlas {

// Fitted to the errors of single shots with 16 and 64 rings and along a simulated drive.
struct SeenOptions {
  // Neighbouring features err together: a scan informs as this share of its features would.
  double information_share = 0.08;
  // However many there are, no place is known better than the map is: standard deviations, of a
  // place also as a share of a cell.
  double map_sigma_m = 0.01;
  double map_sigma_cells = 0.04;
  double coarse_sigma_cells = 0.4;  // a coarse cell stands where any of its fine ones does
  double map_sigma_rad = 0.0006;
};

// About (x, y, z, yaw), world axes. Between this place and `rival`, away from here in the plane, it
// does not know which.
Eigen::Matrix4d SeenInformation(const RegistrationResult& registration,
                                const CoverAtScan& cover,
                                const std::optional<Eigen::Vector2d>& rival,
                                const SeenOptions& options);

}  // namespace atlas
