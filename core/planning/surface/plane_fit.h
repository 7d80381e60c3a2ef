// The least-squares plane through heights on a grid, and how steep it is.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

namespace atlas {

class PlaneFit {
 public:
  // A height in metres at a cell (x, y); coordinates are small integers, so sums are exact.
  void Add(std::int32_t x, std::int32_t y, double height_m) {
    ++n_;
    x_ += x;
    y_ += y;
    z_ += height_m;
    xx_ += std::int64_t{x} * x;
    xy_ += std::int64_t{x} * y;
    yy_ += std::int64_t{y} * y;
    xz_ += x * height_m;
    yz_ += y * height_m;
  }

  // The length of the gradient in metres per cell; none of fewer than five heights or of heights on
  // one line.
  std::optional<double> Gradient() const {
    constexpr std::int64_t kMinHeights = 5;
    // n times the central moments.
    const auto xx = static_cast<double>(n_ * xx_ - x_ * x_);
    const auto xy = static_cast<double>(n_ * xy_ - x_ * y_);
    const auto yy = static_cast<double>(n_ * yy_ - y_ * y_);
    const double determinant = xx * yy - xy * xy;
    if (n_ < kMinHeights || determinant <= 0.0) {
      return std::nullopt;
    }
    const auto n = static_cast<double>(n_);
    const double xz = n * xz_ - static_cast<double>(x_) * z_;
    const double yz = n * yz_ - static_cast<double>(y_) * z_;
    return std::hypot((yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant);
  }

 private:
  std::int64_t n_ = 0;
  std::int64_t x_ = 0;
  std::int64_t y_ = 0;
  std::int64_t xx_ = 0;
  std::int64_t xy_ = 0;
  std::int64_t yy_ = 0;
  double z_ = 0.0;
  double xz_ = 0.0;
  double yz_ = 0.0;
};

}  // namespace atlas
