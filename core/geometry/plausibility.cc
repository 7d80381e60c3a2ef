#include "core/geometry/plausibility.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

struct Bound {
  const char* what;
  double speed_mps = 0.0;
  double jump_m = 0.0;
};

struct Way {
  double length_m = 0.0;
  double climb_m = 0.0;  // up and down
  double time_s = 0.0;   // of all steps
};

double Metres(std::int64_t from_um, std::int64_t to_um) {
  return 1e-6 * (static_cast<double>(to_um) - static_cast<double>(from_um));
}

double Seconds(const UploadedPlace& from, const UploadedPlace& to) {
  return 1e-3 * std::abs(static_cast<double>(to.time_ms) - static_cast<double>(from.time_ms));
}

void AddStep(const UploadedPlace& from, const UploadedPlace& to, Way& way) {
  const double climb_m = Metres(from.z_um, to.z_um);
  way.length_m += std::hypot(Metres(from.x_um, to.x_um), Metres(from.y_um, to.y_um), climb_m);
  way.climb_m += std::abs(climb_m);
  way.time_s += std::min(Seconds(from, to), kLongestStep_s);
}

std::string Fixed(double value, int digits) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 std::chars_format::fixed, digits);
  return {text.data(), end.ptr};
}

std::optional<std::string> Exceeding(const Bound& bound, double way_m, double time_s) {
  if (bound.speed_mps <= 0.0 || way_m <= bound.jump_m + bound.speed_mps * time_s) {
    return std::nullopt;
  }
  return StrCat(Fixed(way_m, 0), bound.what, " in ", Fixed(time_s, 2), " s, at most ",
                bound.speed_mps, " m/s and ", bound.jump_m, " m");
}

}  // namespace

std::optional<ImplausibleWay> UploadedTrack::Add(const UploadedPlace& place) {
  std::optional<std::string> finding;
  std::uint32_t first = 0;
  Way way;
  const UploadedPlace* next = &place;
  for (auto from = last_.rbegin(); from != last_.rend() && !finding; ++from) {
    AddStep(*from, *next, way);
    const double time_s = std::min(way.time_s, Seconds(*from, place));
    finding = Exceeding({" m", limits_.max_speed_mps, limits_.max_jump_m}, way.length_m, time_s);
    if (!finding) {
      finding = Exceeding({" m up or down", limits_.max_climb_mps, limits_.max_height_jump_m},
                          way.climb_m, time_s);
    }
    first = from->sequence;
    next = &*from;
  }
  last_.push_back(place);
  if (last_.size() > kMostJudgedSteps) {
    last_.pop_front();
  }
  return finding ? std::optional(ImplausibleWay{
                       first, place.sequence,
                       StrCat("keyframe ", first, " to ", place.sequence, ": ", *finding)})
                 : std::nullopt;
}

}  // namespace atlas
