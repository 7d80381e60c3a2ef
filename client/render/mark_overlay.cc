#include "client/render/mark_overlay.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace atlas {
namespace {

constexpr double kLeast_px = 3.0;
constexpr double kFar_px = 1e6;  // beyond any picture

}  // namespace

void DrawMarks(const std::vector<MapMark>& marks,
               const PixelBox& box,
               double metres_per_pixel,
               std::int64_t margin_px,
               Image& image) {
  const auto margin = static_cast<double>(margin_px);
  const auto pixel = [](double v, std::uint32_t size) {
    return static_cast<std::uint32_t>(std::clamp(std::round(v), 0.0, static_cast<double>(size)));
  };
  for (const MapMark& mark : marks) {
    const double x = mark.center_m.x() / metres_per_pixel - static_cast<double>(box.min_x) + margin;
    const double y =
        static_cast<double>(box.max_y + 1) - mark.center_m.y() / metres_per_pixel + margin;
    if (!(std::abs(x) < kFar_px && std::abs(y) < kFar_px)) continue;
    const double half = 0.5 * std::max(kLeast_px, mark.side_m / metres_per_pixel);
    for (std::uint32_t row = pixel(y - half, image.height); row < pixel(y + half, image.height);
         ++row) {
      for (std::uint32_t column = pixel(x - half, image.width);
           column < pixel(x + half, image.width); ++column) {
        image.at(column, row) = mark.color;
      }
    }
  }
}

}  // namespace atlas
