#include "client/merge/report/change_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "client/render/map_picture.h"

namespace atlas {
namespace {

constexpr double kMaxSide_px = 2'500.0;
constexpr Rgb kAppeared{255, 48, 48};
constexpr Rgb kVanished{64, 144, 255};

PixelBox BoxOf(const Eigen::AlignedBox2d& part, double pixel_m) {
  PixelBox box;
  for (const Eigen::Vector2d& corner : {part.min(), part.max()}) {
    box.Add(static_cast<std::int64_t>(std::floor(corner.x() / pixel_m)),
            static_cast<std::int64_t>(std::floor(corner.y() / pixel_m)));
  }
  return box;
}

int ShiftFor(const Eigen::AlignedBox2d& part, double cell_size_m) {
  const double pixels = part.sizes().maxCoeff() / cell_size_m;
  return std::max(0, static_cast<int>(std::ceil(std::log2(pixels / kMaxSide_px))));
}

}  // namespace

ChangePicture::ChangePicture(const Eigen::AlignedBox2d& part, const MapProfile& profile)
    : cell_size_m_(profile.cell_size_m()),
      shift_(ShiftFor(part, cell_size_m_)),
      raster_(BoxOf(part, cell_size_m_ * static_cast<double>(1 << shift_)), shift_, {}, profile) {}

Image ChangePicture::Finish(std::span<const MapChange> changes) const {
  RenderOptions options;
  for (const MapChange& change : changes) {
    for (const ChangedCell& cell : change.cells) {
      options.marks.push_back({cell_size_m_ * Eigen::Vector2d(static_cast<double>(cell.x) + 0.5,
                                                              static_cast<double>(cell.y) + 0.5),
                               cell_size_m_,
                               change.kind == ChangeKind::kAppeared ? kAppeared : kVanished});
    }
  }
  return DrawPicture(raster_, options, cell_size_m_ * static_cast<double>(1 << shift_));
}

}  // namespace atlas
