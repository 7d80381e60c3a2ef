#include "core/fusion/combination/evidence_folder.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <limits>
#include <numeric>

#include "core/base/integer_math.h"
#include "core/base/small_sort.h"

namespace atlas {
namespace {

std::uint8_t FlagsOf(const CellLayer& layer, int occupancy) {
  const bool is_free = occupancy < 0;
  return static_cast<std::uint8_t>(
      (is_free ? TileLayer::kTraversable | TileLayer::kTraversableAny : 0) |
      (layer.is_measured ? TileLayer::kMeasured : 0));
}

// How many values of a layer's column are published.
std::size_t ValuesIn(const ColumnSpan& span) {
  return static_cast<std::size_t>(std::popcount(span.mask)) / 4;
}

// Seconds since 1970, as a tile says them; times before are 0.
std::uint32_t SecondsOf(std::int64_t time_ms) {
  constexpr std::int64_t kMax = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(FloorDiv(time_ms, 1000), 0, kMax));
}

}  // namespace

void EvidenceFolder::Fold(std::span<const SegmentView> segments,
                          std::span<const std::uint32_t> labels,
                          std::span<const CellLayer> layers,
                          const std::int32_t* above_mm,
                          std::vector<TileLayer>& out) {
  Begin(layers, above_mm);
  SortByTime(segments);
  const FoldClamp clamp{static_cast<std::int8_t>(profile_.stretch_clamp),
                        static_cast<std::int8_t>(profile_.carry_clamp),
                        static_cast<std::int8_t>(profile_.evidence_clamp)};
  for (const std::uint32_t i : order_) {
    if (labels[i] == kNoLayer) {
      continue;
    }
    const Segment& segment = *segments[i].segment;
    const bool is_about_it = SpeaksOfOccupancy(segment, layers[labels[i]]);
    SegmentSay say{.time_ms = segments[i].last_time_ms,
                   .driven_ms = segments[i].driven_ms,
                   .session = segments[i].session,
                   .layer = labels[i],
                   .occupancy = is_about_it ? segment.occupancy : 0,
                   .column_base = segment.column_base,
                   .column = segment.column};
    drives_.Hear(say);
    Sum& sum = sums_[labels[i]];
    sum.occupancy = FoldEvidence(sum.occupancy, say.occupancy, clamp);
    const std::int64_t offset = std::int64_t{sum.span.base} - say.column_base;
    const bool is_foot_gone = sum.has_stood && sum.occupancy < 0 && segment.is_strong && can_stand_;
    sum.has_stood = sum.occupancy > 0 || (sum.has_stood && !is_foot_gone);
    if (is_foot_gone) {
      const ColumnSum before = sum.column;
      sum.column.Fold(say.column, segment.column_seen, offset, clamp);
      sum.column.DropWhatStood(before, say.column, offset, ValuesIn(sum.span));
    } else if (segment.column_seen != 0) {
      sum.column.Fold(say.column, segment.column_seen, offset, clamp);
    }
  }
  for (std::size_t layer = 0; layer < layers.size(); ++layer) {
    out.push_back(Finish(layers[layer], sums_[layer]));
  }
}

void EvidenceFolder::Begin(std::span<const CellLayer> layers, const std::int32_t* above_mm) {
  sums_.clear();
  drives_.Clear();
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const std::int32_t* above = i + 1 < layers.size() ? &layers[i + 1].altitude_mm : above_mm;
    sums_.push_back({ColumnSpanOf(layers[i].altitude_mm, above, profile_), 0, false, {}});
  }
}

void EvidenceFolder::SortByTime(std::span<const SegmentView> segments) {
  order_.resize(segments.size());
  std::iota(order_.begin(), order_.end(), 0u);
  SmallStableSort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return WasSeenEarlier(segments[a], segments[b]);
  });
}

bool EvidenceFolder::SpeaksOfOccupancy(const Segment& segment, const CellLayer& layer) const {
  return segment.is_strong || !layer.is_measured || profile_.preset == FusionPreset::kPaper ||
         std::abs(std::int64_t{segment.altitude_mm} - layer.altitude_mm) <= profile_.same_layer_mm;
}

TileLayer EvidenceFolder::Finish(const CellLayer& surface, const Sum& sum) {
  constexpr std::uint32_t kMaxObservations = std::numeric_limits<std::uint16_t>::max();
  TileLayer result;
  result.altitude_mm = surface.altitude_mm;
  result.sigma_100um = surface.sigma_100um;
  result.occupancy = static_cast<std::int8_t>(sum.occupancy);
  result.flags = FlagsOf(surface, sum.occupancy);
  result.observations =
      static_cast<std::uint16_t>(std::min(surface.observations, kMaxObservations));
  result.confirmed_s = SecondsOf(surface.last_time_ms);
  result.column = sum.column.Nibbles(sum.span.mask);
  return result;
}

}  // namespace atlas
