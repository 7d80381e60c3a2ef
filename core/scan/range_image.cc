#include "core/scan/range_image.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace atlas {
namespace {

constexpr float kFar_m = 1e6F;

int Sector(float azimuth_rad) {
  constexpr float kScale = RangeImage::kSectors / (2.0F * std::numbers::pi_v<float>);
  return std::clamp(static_cast<int>(azimuth_rad * kScale), 0, RangeImage::kSectors - 1);
}

}  // namespace

int RingStep(int channels, int rings) {
  return std::max(1, static_cast<int>(std::lround(static_cast<double>(channels) / rings)));
}

RangeImage MakeRangeImage(const PointCloud& cloud, const SensorLayout& layout, int ring_step) {
  const RingSplit split = SplitRings(cloud, layout.ego);
  const std::vector<int> rows = AssignRows(split, layout.elevation_rad);
  RangeImage image;
  image.rows = (layout.channels() + ring_step - 1) / ring_step;
  image.sector_begin.assign(static_cast<std::size_t>(image.rows * RangeImage::kSectors + 1), 0);
  const auto for_each_return = [&](auto&& visit) {
    for (std::size_t k = 0; k < split.runs.size(); ++k) {
      if (rows[k] % ring_step != 0) {
        continue;
      }
      const int first = rows[k] / ring_step * RangeImage::kSectors;
      for (std::uint32_t i = split.runs[k].begin; i < split.runs[k].end; ++i) {
        visit(static_cast<std::size_t>(first + Sector(split.azimuth_rad[i])), split.index[i]);
      }
    }
  };
  std::size_t size = 0;
  for_each_return([&](std::size_t bin, std::uint32_t) {
    ++image.sector_begin[bin + 1];
    ++size;
  });
  for (std::size_t bin = 1; bin < image.sector_begin.size(); ++bin) {
    image.sector_begin[bin] += image.sector_begin[bin - 1];
  }
  image.source.resize(size);
  for (std::vector<float>* plane : {&image.x, &image.y, &image.z}) {
    plane->assign(size + RangeImage::kPadding, kFar_m);
  }
  std::vector<std::uint32_t> next(image.sector_begin.begin(), image.sector_begin.end() - 1);
  for_each_return([&](std::size_t bin, std::uint32_t index) {
    const std::uint32_t at = next[bin]++;
    const Eigen::Vector3f& p = cloud.points[index];
    image.x[at] = p.x();
    image.y[at] = p.y();
    image.z[at] = p.z();
    image.source[at] = index;
  });
  return image;
}

}  // namespace atlas
