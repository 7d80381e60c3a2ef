// Discs along the lines, closer than they are wide.
#include "client/render/route_overlay.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace atlas {
namespace {

constexpr Rgb kRim{20, 8, 28};
constexpr Rgb kLine{255, 64, 208};
constexpr Rgb kStart{64, 224, 96};
constexpr Rgb kGoal{255, 72, 56};
constexpr double kLine_px = 1.6;
constexpr double kEnd_px = 6.0;
constexpr double kRim_px = 1.2;

class Pen {
 public:
  Pen(const PixelBox& box, double metres_per_pixel, std::int64_t margin_px, Image& image)
      : box_(box), metres_per_pixel_(metres_per_pixel), margin_px_(margin_px), image_(image) {}

  // In pixels of the image, from its top left corner.
  Eigen::Vector2d Place(const Eigen::Vector3d& p) const {
    const auto margin = static_cast<double>(margin_px_);
    return {p.x() / metres_per_pixel_ - static_cast<double>(box_.min_x) + margin,
            static_cast<double>(box_.max_y + 1) - p.y() / metres_per_pixel_ + margin};
  }

  void Disc(const Eigen::Vector2d& at, double radius_px, const Rgb& color) {
    const std::int64_t width = image_.width;
    const std::int64_t height = image_.height;
    const auto first = [radius_px](double v) {
      return std::max<std::int64_t>(0, static_cast<std::int64_t>(std::floor(v - radius_px)));
    };
    const auto end = [radius_px](double v, std::int64_t size) {
      return std::min(size, static_cast<std::int64_t>(std::ceil(v + radius_px)));
    };
    for (std::int64_t y = first(at.y()); y < end(at.y(), height); ++y) {
      for (std::int64_t x = first(at.x()); x < end(at.x(), width); ++x) {
        const Eigen::Vector2d middle(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
        if ((middle - at).norm() <= radius_px) {
          image_.at(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) = color;
        }
      }
    }
  }

  void Line(const Eigen::Vector2d& from,
            const Eigen::Vector2d& to,
            double radius_px,
            const Rgb& color) {
    const double steps = std::max(1.0, std::ceil((to - from).norm()));
    for (double i = 0.0; i <= steps; i += 1.0) {
      Disc(from + i / steps * (to - from), radius_px, color);
    }
  }

 private:
  const PixelBox& box_;
  double metres_per_pixel_;
  std::int64_t margin_px_;
  Image& image_;
};

bool IsNear(const Eigen::Vector2d& p, const Image& image) {
  const double reach = 4.0 * std::max(image.width, image.height);
  return p.allFinite() && p.cwiseAbs().maxCoeff() <= reach;
}

}  // namespace

void DrawRoute(const std::vector<Eigen::Vector3d>& points,
               const PixelBox& box,
               double metres_per_pixel,
               std::int64_t margin_px,
               Image& image) {
  Pen pen(box, metres_per_pixel, margin_px, image);
  std::vector<Eigen::Vector2d> places;
  for (const Eigen::Vector3d& p : points) {
    if (IsNear(pen.Place(p), image)) places.push_back(pen.Place(p));
  }
  if (places.empty()) return;
  for (const auto& [radius_px, color] :
       {std::pair(kLine_px + kRim_px, kRim), std::pair(kLine_px, kLine)}) {
    for (std::size_t i = 1; i < places.size(); ++i) {
      pen.Line(places[i - 1], places[i], radius_px, color);
    }
  }
  for (const auto& [at, color] :
       {std::pair(places.front(), kStart), std::pair(places.back(), kGoal)}) {
    pen.Disc(at, kEnd_px + kRim_px, kRim);
    pen.Disc(at, kEnd_px, color);
  }
}

}  // namespace atlas
