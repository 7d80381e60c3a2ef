// How a drive lies by positions of its scans that are known from elsewhere.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include <Eigen/Core>

#include "client/drive/anchor/anchor_fit.h"
#include "core/localization/registration/pose_prior.h"
#include "core/localization/relocalizer.h"
#include "core/scan/drive_folder.h"
#include "core/scan/position_file.h"

namespace atlas {

// Where a scan may be, by its position: three standard deviations around, and a metre.
PlacePrior PriorOf(const KnownPlace& place);

struct PositionFit {
  std::size_t positions = 0;  // of the scans
  // From there to where the transform puts them, the median along each axis; and of the radii.
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();
  double radius_m = 0.0;
};

PositionFit FitPositions(std::span<const DriveScan* const> scans,
                         const KnownPlaces& positions,
                         const LevelTransform& T_map_drive);

// What is too far off, for people; empty: nothing is. A receiver's errors stay for a while, so that
// those of a drive need not have a mean of nothing: two standard deviations are allowed, and half a
// metre. Decks are 3 m apart.
std::string WhyOff(const PositionFit& fit);

}  // namespace atlas
