#include "core/scan/sensor_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr float kDeg = std::numbers::pi_v<float> / 180.0F;
// Mean spacings: VLP-16 2.0 and every fourth ring of an HDL-64 1.7; HDL-32 1.33 and every second
// ring of an HDL-64 0.85; OS1-64 0.71, HDL-64 0.43 degrees.
constexpr float kSpacing16_rad = 1.5F * kDeg;
constexpr float kSpacing32_rad = 0.78F * kDeg;
constexpr std::uint32_t kMinRunReturns = 8;  // fewer do not tell where a ring points
constexpr float kNewRow = 0.6F;  // of the spacing: farther from every row is another row

// Whether the returns are in another order than ring after ring: in more pieces than the richest
// sensor has rings, each cut several times, or mostly in pieces that no ring is as wide as.
bool IsScattered(const RingSplit& split) {
  constexpr std::size_t kMostPieces = 4 * 64;
  constexpr float kWidest = 0.2F;  // 11 degrees; those of an HDL-64E reach 5
  std::size_t wide = 0;
  for (const RingRun& run : split.runs) {
    wide += run.spread > kWidest ? run.size() : 0;
  }
  return split.runs.size() > kMostPieces || 2 * wide > split.index.size();
}

// Bottom-first copies of the runs that are long enough.
std::vector<float> RunElevations(const RingSplit& split) {
  std::vector<float> elevations;
  for (const RingRun& run : split.runs) {
    if (run.size() >= kMinRunReturns) {
      elevations.push_back(run.elevation_rad);
    }
  }
  if (!split.is_bottom_first) {
    std::reverse(elevations.begin(), elevations.end());
  }
  return elevations;
}

float MedianSpacing(std::span<const float> sorted) {
  std::vector<float> gaps;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    gaps.push_back(sorted[i] - sorted[i - 1]);
  }
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  return *middle;
}

float MeanSpacing(std::span<const float> sorted) {
  return (sorted.back() - sorted.front()) / static_cast<float>(sorted.size() - 1);
}

// Whether all channels are about as far apart (VLP-16, HDL-32, HDL-64), judged by those that point
// at the ground and always return: how many there are in between and above can then be told by the
// spacing. Those of a VLP-32C or a Pandar40 crowd around the horizon: there are those that are
// seen.
bool IsEven(std::span<const float> rows) {
  constexpr float kDown_rad = -3.0F * kDeg;
  constexpr std::size_t kEnough = 6;
  constexpr float kWidestGap = 2.5F;  // of the median: one channel may be dead
  const auto down = rows.first(static_cast<std::size_t>(
      std::lower_bound(rows.begin(), rows.end(), kDown_rad) - rows.begin()));
  if (down.size() < kEnough) {
    return true;
  }
  const float most = kWidestGap * MedianSpacing(down);
  for (std::size_t i = 1; i < down.size(); ++i) {
    if (down[i] - down[i - 1] > most) {
      return false;
    }
  }
  return true;
}

// Without the rows that halves of rings made: they lie closer to another than rings do.
std::vector<float> WithoutHalves(std::span<const float> rows) {
  constexpr float kHalf = 0.4F;
  const float least = kHalf * MedianSpacing(rows);
  std::vector<float> kept{rows.front()};
  for (const float row : rows.subspan(1)) {
    if (row - kept.back() >= least) {
      kept.push_back(row);
    }
  }
  return kept;
}

int ChannelsByCount(std::size_t rows) {
  return rows > 38 ? 64 : (rows > 19 ? 32 : 16);  // a few too many are halves of rings
}

int ChannelsBySpacing(float spacing_rad) {
  return spacing_rad > kSpacing16_rad ? 16 : (spacing_rad > kSpacing32_rad ? 32 : 64);
}

// Where two neighbours are two spacings apart there is one that no scan ever showed.
void FillGaps(std::vector<float>& rows, std::size_t channels, float spacing_rad) {
  for (std::size_t i = 1; i < rows.size() && rows.size() < channels; ++i) {
    if (rows[i] - rows[i - 1] > 1.7F * spacing_rad) {
      rows.insert(rows.begin() + static_cast<std::ptrdiff_t>(i), rows[i - 1] + spacing_rad);
    }
  }
}

}  // namespace

void SensorLayoutEstimator::Add(const PointCloud& cloud) {
  const RingSplit split = SplitRings(cloud, ego_);
  scans_ += split.runs.empty() ? 0 : 1;
  scattered_scans_ += IsScattered(split) ? 1 : 0;
  std::vector<float> seen = RunElevations(split);
  std::sort(seen.begin(), seen.end());
  if (seen.size() > elevation_rad_.size()) {
    std::swap(seen, elevation_rad_);  // the richest scan is the template
  }
  if (elevation_rad_.size() < 2) {
    return;
  }
  const float new_row = kNewRow * MedianSpacing(elevation_rad_);
  for (const float elevation : seen) {
    const auto above = std::lower_bound(elevation_rad_.begin(), elevation_rad_.end(), elevation);
    const bool is_near_above = above != elevation_rad_.end() && *above - elevation < new_row;
    const bool is_near_below =
        above != elevation_rad_.begin() && elevation - *std::prev(above) < new_row;
    if (!is_near_above && !is_near_below) {
      elevation_rad_.insert(above, elevation);
    }
  }
}

Result<SensorLayout> SensorLayoutEstimator::Estimate() const {
  if (elevation_rad_.size() < 2) {
    return Error(StatusCode::kInvalidData,
                 "no scan shows two rings: expected returns stored ring after ring");
  }
  if (2 * scattered_scans_ > scans_) {
    return Error(
        StatusCode::kInvalidData,
        "returns are in no order, or stored column after column: expected ring after ring");
  }
  std::vector<float> rows = WithoutHalves(elevation_rad_);
  const bool is_even = IsEven(rows);
  const float spacing = std::min(MeanSpacing(rows), 1.2F * MedianSpacing(rows));
  const auto channels = static_cast<std::size_t>(
      std::max(ChannelsByCount(rows.size()), is_even ? ChannelsBySpacing(spacing) : 0));
  while (rows.size() > channels) {  // halves that lay farther away, or a sensor of 128
    std::size_t closest = 1;
    for (std::size_t i = 2; i < rows.size(); ++i) {
      if (rows[i] - rows[i - 1] < rows[closest] - rows[closest - 1]) {
        closest = i;
      }
    }
    rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(closest));
  }
  if (is_even) {
    FillGaps(rows, channels, spacing);
  }
  while (rows.size() < channels) {  // those that see only sky
    rows.push_back(rows.back() + spacing);
  }
  return SensorLayout{ego_, std::move(rows)};
}

std::vector<int> AssignRows(const RingSplit& split, std::span<const float> elevation_rad) {
  const std::size_t runs = split.runs.size();
  const std::size_t rows = elevation_rad.size();
  // cost[k][r]: runs 0..k with run k in row r, rows never falling; staying in a row costs a little,
  // so that as many rings as there are rows keep one each.
  constexpr float kShare = 0.004F;
  std::vector<std::vector<float>> cost(runs, std::vector<float>(rows));
  std::vector<std::vector<int>> from(runs, std::vector<int>(rows, 0));
  const auto run_at = [&](std::size_t k) -> const RingRun& {
    return split.runs[split.is_bottom_first ? k : runs - 1 - k];
  };
  for (std::size_t k = 0; k < runs; ++k) {
    float best = std::numeric_limits<float>::max();
    int best_row = 0;
    for (std::size_t r = 0; r < rows; ++r) {
      const float own = std::abs(run_at(k).elevation_rad - elevation_rad[r]);
      if (k == 0) {
        cost[k][r] = own;
        continue;
      }
      const bool shares = cost[k - 1][r] + kShare < best;
      cost[k][r] = own + (shares ? cost[k - 1][r] + kShare : best);
      from[k][r] = shares ? static_cast<int>(r) : best_row;
      if (cost[k - 1][r] < best) {
        best = cost[k - 1][r];
        best_row = static_cast<int>(r);
      }
    }
  }
  std::vector<int> assigned(runs);
  if (runs == 0 || rows == 0) {
    return assigned;
  }
  int row = static_cast<int>(std::min_element(cost[runs - 1].begin(), cost[runs - 1].end()) -
                             cost[runs - 1].begin());
  for (std::size_t k = runs; k-- > 0;) {
    assigned[split.is_bottom_first ? k : runs - 1 - k] = row;
    row = from[k][static_cast<std::size_t>(row)];
  }
  return assigned;
}

}  // namespace atlas
