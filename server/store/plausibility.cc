#include "server/store/plausibility.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

struct Bound {
  const char* what;
  double speed_mps = 0.0;
  double jump_m = 0.0;
};

double Metres(std::int64_t from_um, std::int64_t to_um) {
  return 1e-6 * (static_cast<double>(to_um) - static_cast<double>(from_um));
}

std::string Fixed(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

std::optional<std::string> Exceeding(const Bound& bound, double way_m, double time_s) {
  if (bound.speed_mps <= 0.0 || way_m <= bound.jump_m + bound.speed_mps * time_s) {
    return std::nullopt;
  }
  return StrCat(Fixed(way_m, 0), bound.what, " in ", Fixed(time_s, 2), " s, at most ",
                bound.speed_mps, " m/s and ", bound.jump_m, " m");
}

}  // namespace

std::optional<std::string> FindImplausible(const UploadedPlace& a,
                                           const UploadedPlace& b,
                                           const PlausibilityLimits& limits) {
  const UploadedPlace& from = a.sequence < b.sequence ? a : b;
  const UploadedPlace& to = a.sequence < b.sequence ? b : a;
  const double climb_m = Metres(from.z_um, to.z_um);
  const double way_m = std::hypot(Metres(from.x_um, to.x_um), Metres(from.y_um, to.y_um), climb_m);
  const double time_s =
      1e-3 * std::abs(static_cast<double>(to.time_ms) - static_cast<double>(from.time_ms));
  auto finding = Exceeding({" m", limits.max_speed_mps, limits.max_jump_m}, way_m, time_s);
  if (!finding) {
    finding = Exceeding({" m up or down", limits.max_climb_mps, limits.max_height_jump_m},
                        std::abs(climb_m), time_s);
  }
  return finding ? std::optional(
                       StrCat("keyframe ", from.sequence, " to ", to.sequence, ": ", *finding))
                 : std::nullopt;
}

}  // namespace atlas
