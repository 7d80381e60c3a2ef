#include "client/drive/track_line.h"

#include <array>
#include <charconv>
#include <cmath>

namespace atlas {

std::string FixedNumber(double value, int digits) {
  if (!std::isfinite(value)) return value > 0.0 ? "inf" : "nan";
  std::array<char, 400> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, digits)
          .ptr;
  return {text.data(), end};
}

TrackLine& TrackLine::Add(const std::string& field) {
  if (!is_first_) text_ += separator_;
  is_first_ = false;
  text_ += field;
  return *this;
}

TrackLine& TrackLine::AddEmpty(int fields) {
  for (int i = 0; i < fields; ++i) {
    Add(std::string());
  }
  return *this;
}

TrackLine& TrackLine::Add(const Pose& pose) {
  const Eigen::Vector3d& place = pose.translation();
  const Eigen::Quaterniond turn(pose.linear());
  Add(place.x()).Add(place.y()).Add(place.z());
  return Add(turn.x(), 9).Add(turn.y(), 9).Add(turn.z(), 9).Add(turn.w(), 9);
}

}  // namespace atlas
