// A line of numbers that other programs read.
#pragma once

#include <string>
#include <utility>

#include "core/geometry/pose.h"

namespace atlas {

// With so many digits after the point, whatever the locale; "inf", "nan".
std::string FixedNumber(double value, int digits);

class TrackLine {
 public:
  explicit TrackLine(char separator) : separator_(separator) {}

  TrackLine& Add(const std::string& field);
  TrackLine& Add(double value, int digits = 6) { return Add(FixedNumber(value, digits)); }
  TrackLine& AddEmpty(int fields);
  // x y z, metres, and the quaternion's x y z w.
  TrackLine& Add(const Pose& pose);
  std::string End() && { return std::move(text_) + '\n'; }

 private:
  char separator_;
  bool is_first_ = true;
  std::string text_;
};

}  // namespace atlas
