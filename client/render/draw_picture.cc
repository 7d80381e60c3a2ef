// Colours for the pixels of a raster: DrawPicture of map_picture.h.
#include <algorithm>
#include <cmath>

#include "client/render/color_map.h"
#include "client/render/map_picture.h"
#include "client/render/mark_overlay.h"
#include "client/render/route_overlay.h"
#include "client/render/scale_bar.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

constexpr Rgb kBackground{16, 20, 26};
constexpr Rgb kObstacle{250, 244, 232};
constexpr Rgb kFree{206, 214, 222};
constexpr Rgb kUndecided{92, 99, 108};
constexpr Rgb kBlocked{205, 62, 48};
constexpr Rgb kGround{58, 66, 76};
constexpr Rgb kOtherGround{40, 46, 54};

// Slopes are taken over this many pixels to each side: noise of neighbouring cells is not relief.
constexpr std::int64_t kShadeReach_px = 2;
// Steps higher than this between neighbours are walls or other surfaces, not slopes.
constexpr double kMaxShadeStep_m = 0.6;
constexpr double kShadeStrength = 0.45;
constexpr double kShadeGain = 2.5;
// Altitudes outside of these shares take the end colours, so that one mast does not flatten a city.
constexpr double kLowShare = 0.02;
constexpr double kHighShare = 0.98;
constexpr double kMinHeightRange_m = 2.0;

struct AltitudeRange {
  double low_m = 0.0;
  double high_m = 1.0;

  double Share(double altitude_m) const { return (altitude_m - low_m) / (high_m - low_m); }
};

AltitudeRange RangeOf(const MapRaster& raster) {
  std::vector<std::int32_t> altitudes;
  const PixelBox& box = raster.content();
  for (std::int64_t y = box.min_y; y <= box.max_y; ++y) {
    for (std::int64_t x = box.min_x; x <= box.max_x; ++x) {
      if (raster.at(x, y).layer_count > 0) altitudes.push_back(raster.at(x, y).altitude_mm);
    }
  }
  if (altitudes.empty()) return {};
  const auto quantile = [&altitudes](double share) {
    const auto rank =
        static_cast<std::ptrdiff_t>(share * static_cast<double>(altitudes.size() - 1));
    std::nth_element(altitudes.begin(), altitudes.begin() + rank, altitudes.end());
    return altitudes[static_cast<std::size_t>(rank)] * 1e-3;
  };
  AltitudeRange range{quantile(kLowShare), quantile(kHighShare)};
  const double missing_m = kMinHeightRange_m - (range.high_m - range.low_m);
  if (missing_m > 0.0) {
    range.low_m -= 0.5 * missing_m;
    range.high_m += 0.5 * missing_m;
  }
  return range;
}

class Painter {
 public:
  Painter(const MapRaster& raster, const RenderOptions& options, double metres_per_pixel)
      : raster_(raster),
        options_(options),
        metres_per_pixel_(metres_per_pixel),
        range_(RangeOf(raster)),
        max_column_top_mm_(MaxColumnTop(raster)) {}

  Rgb Color(std::int64_t x, std::int64_t y) const {
    const MapPixel& pixel = raster_.at(x, y);
    if (pixel.layer_count == 0) return kBackground;
    switch (options_.color) {
      case MapColor::kHeight:
        return Height(pixel, x, y);
      case MapColor::kOccupancy:
        return Occupancy(pixel);
      case MapColor::kLayers:
        return Shade(CountColor(pixel.layer_count), Relief(x, y));
      case MapColor::kColumns:
        return Columns(pixel);
    }
    return kBackground;
  }

 private:
  static double MaxColumnTop(const MapRaster& raster) {
    std::int32_t top = 1;
    const PixelBox& box = raster.content();
    for (std::int64_t y = box.min_y; y <= box.max_y; ++y) {
      for (std::int64_t x = box.min_x; x <= box.max_x; ++x) {
        top = std::max(top, raster.at(x, y).column_top_mm);
      }
    }
    return top;
  }

  Rgb Height(const MapPixel& pixel, std::int64_t x, std::int64_t y) const {
    const Rgb ground =
        Shade(HeightColor(range_.Share(pixel.altitude_mm * 1e-3)), 0.9 * Relief(x, y));
    if (pixel.is_traversable) return ground;
    const double p = EvidenceProbability(pixel.occupancy);
    return p > 0.5 ? Mix(ground, kObstacle, std::min(1.0, 2.2 * (p - 0.5))) : Shade(ground, 0.7);
  }

  static Rgb Occupancy(const MapPixel& pixel) {
    const double share = (EvidenceProbability(pixel.occupancy) - 0.5) / 0.4;
    return share < 0.0 ? Mix(kUndecided, kFree, -share) : Mix(kUndecided, kBlocked, share);
  }

  Rgb Columns(const MapPixel& pixel) const {
    if (pixel.column_top_mm > 0) {
      return ColumnColor(0.3 + 0.7 * pixel.column_top_mm / max_column_top_mm_);
    }
    return pixel.is_traversable ? kGround : kOtherGround;
  }

  // Rise towards (dx, dy), metres per metre; 0 where the surface ends or steps.
  double Slope(std::int64_t x, std::int64_t y, std::int64_t dx, std::int64_t dy) const {
    if (!raster_.box().Contains(x - dx, y - dy) || !raster_.box().Contains(x + dx, y + dy)) {
      return 0.0;
    }
    const MapPixel& before = raster_.at(x - dx, y - dy);
    const MapPixel& after = raster_.at(x + dx, y + dy);
    if (before.layer_count == 0 || after.layer_count == 0) return 0.0;
    const double rise_m = (after.altitude_mm - before.altitude_mm) * 1e-3;
    if (std::abs(rise_m) > kMaxShadeStep_m) return 0.0;
    return rise_m / (2.0 * static_cast<double>(kShadeReach_px) * metres_per_pixel_);
  }

  // Brightness under a light from the north-west.
  double Relief(std::int64_t x, std::int64_t y) const {
    const double facing = Slope(x, y, kShadeReach_px, 0) - Slope(x, y, 0, kShadeReach_px);
    return 1.0 + kShadeStrength * std::tanh(kShadeGain * facing);
  }

  const MapRaster& raster_;
  const RenderOptions& options_;
  double metres_per_pixel_;
  AltitudeRange range_;
  double max_column_top_mm_;
};

}  // namespace

Image DrawPicture(const MapRaster& raster, const RenderOptions& options, double metres_per_pixel) {
  const PixelBox& box = raster.content();
  const std::int64_t margin = options.margin_px;
  Image image;
  image.width = static_cast<std::uint32_t>(box.width() + 2 * margin);
  const std::int64_t footer = options.has_scale_bar ? kScaleBarHeight_px : 0;
  image.height = static_cast<std::uint32_t>(box.height() + 2 * margin + footer);
  image.pixels.assign(std::size_t{image.width} * image.height, kBackground);
  const Painter painter(raster, options, metres_per_pixel);
  for (std::int64_t y = box.min_y; y <= box.max_y; ++y) {
    for (std::int64_t x = box.min_x; x <= box.max_x; ++x) {
      image.at(static_cast<std::uint32_t>(x - box.min_x + margin),
               static_cast<std::uint32_t>(box.max_y - y + margin)) = painter.Color(x, y);
    }
  }
  DrawMarks(options.marks, box, metres_per_pixel, margin, image);
  DrawRoute(options.route, box, metres_per_pixel, margin, image);
  if (options.has_scale_bar) DrawScaleBar(metres_per_pixel, margin, image);
  return image;
}

}  // namespace atlas
