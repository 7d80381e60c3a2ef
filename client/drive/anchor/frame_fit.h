// How well the scans of a drive lie in a map where one transform puts them: all of them, and those
// that lie worst, for a drive that fits nearly everywhere is as wrong as any where it does not.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <string>

#include "client/drive/anchor/anchor_fit.h"

namespace atlas {

// A scan of a drive, where the drive and the map have it.
struct FollowedScan {
  std::size_t index = 0;  // in the drive
  bool is_found = false;  // else it is lost there, or elsewhere
  double fit = 0.0;       // to the map, if it is found, as of RegistrationResult
  FoundScan scan;
};

struct FrameFit {
  std::size_t tracked = 0;         // scans that were found
  std::size_t astray = 0;          // and that were not,
  std::size_t longest_astray = 0;  // so many in a row
  // Of where and how they were found, from where the transform puts them: all, and the ten in a row
  // that are off the most. Turned about any axis: what is tilted otherwise makes other keyframes.
  double rms_m = 0.0;
  double worst_rms_m = 0.0;
  double rms_rad = 0.0;
  double worst_rms_rad = 0.0;
};

// More is not to be live in the map: it would be blurred there, or doubled.
struct FrameLimits {
  double rms_m = 0.0;
  double rms_rad = 0.0;
  double worst_rms_m = 0.0;
  double worst_rms_rad = 0.0;
  std::size_t longest_astray = 0;
  std::size_t found_per_astray = 1;  // astray may be one, and one more for so many that are found
};

// `scans` in the order of the drive.
FrameFit MeasureFrame(std::span<const FollowedScan> scans, const LevelTransform& T_map_drive);

// What exceeds the limits, for people; empty: nothing does.
std::string WhyBeyond(const FrameFit& fit, const FrameLimits& limits);

// As errors tell it.
inline double InThousandths(double value) {
  return std::round(value * 1e3) / 1e3;
}

}  // namespace atlas
