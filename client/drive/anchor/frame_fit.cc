#include "client/drive/anchor/frame_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::size_t kStretch = 10;

// Root of the mean of all squares, and the largest one of kStretch squares in a row, or of fewer.
struct Means {
  double all = 0.0;
  double worst = 0.0;
};

Means MeansOf(const std::vector<double>& squares) {
  Means means;
  if (squares.empty()) return means;
  const std::size_t stretch = std::min(kStretch, squares.size());
  double all = 0.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    all += squares[i];
    sum += squares[i] - (i >= stretch ? squares[i - stretch] : 0.0);
    if (i + 1 >= stretch) means.worst = std::max(means.worst, sum);
  }
  means.all = std::sqrt(all / static_cast<double>(squares.size()));
  means.worst = std::sqrt(means.worst / static_cast<double>(stretch));
  return means;
}

double Degrees(double rad) {
  return rad * 180.0 / std::numbers::pi;
}

}  // namespace

FrameFit MeasureFrame(std::span<const FollowedScan> scans, const LevelTransform& T_map_drive) {
  FrameFit fit;
  std::vector<double> squares_m2;
  std::vector<double> squares_rad2;
  std::size_t in_a_row = 0;
  for (const FollowedScan& followed : scans) {
    if (!followed.is_found) {
      ++fit.astray;
      fit.longest_astray = std::max(fit.longest_astray, ++in_a_row);
      continue;
    }
    ++fit.tracked;
    in_a_row = 0;
    const FrameOffset offset = OffsetFrom(T_map_drive, followed.scan);
    squares_m2.push_back(offset.place_m.squaredNorm());
    squares_rad2.push_back(offset.turn_rad * offset.turn_rad);
  }
  const Means metres = MeansOf(squares_m2);
  const Means turns = MeansOf(squares_rad2);
  fit.rms_m = metres.all;
  fit.worst_rms_m = metres.worst;
  fit.rms_rad = turns.all;
  fit.worst_rms_rad = turns.worst;
  return fit;
}

std::string WhyBeyond(const FrameFit& fit, const FrameLimits& limits) {
  if (fit.rms_m > limits.rms_m || fit.rms_rad > limits.rms_rad) {
    return StrCat("bent against the map: ", InThousandths(fit.rms_m), " m and ",
                  InThousandths(Degrees(fit.rms_rad)),
                  " deg RMS from one transform, expected at most ", limits.rms_m, " m and ",
                  InThousandths(Degrees(limits.rms_rad)), " deg");
  }
  if (fit.worst_rms_m > limits.worst_rms_m || fit.worst_rms_rad > limits.worst_rms_rad) {
    return StrCat("bent against the map where it is off the most: ", InThousandths(fit.worst_rms_m),
                  " m and ", InThousandths(Degrees(fit.worst_rms_rad)),
                  " deg RMS from one transform, expected at most ", limits.worst_rms_m, " m and ",
                  InThousandths(Degrees(limits.worst_rms_rad)), " deg");
  }
  if (fit.longest_astray > limits.longest_astray) {
    return StrCat("astray: ", fit.longest_astray,
                  " scans in a row do not fit the map where one transform puts them, expected at "
                  "most ",
                  limits.longest_astray);
  }
  if (fit.astray > 1 + fit.tracked / limits.found_per_astray) {
    return StrCat("astray: ", fit.astray, " scans do not fit the map where one transform puts ",
                  "them, and ", fit.tracked, " do, expected at most ",
                  1 + fit.tracked / limits.found_per_astray);
  }
  return {};
}

}  // namespace atlas
