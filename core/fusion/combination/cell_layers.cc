#include "core/fusion/combination/cell_layers.h"

#include <algorithm>
#include <cstdlib>

#include "core/base/integer_math.h"
#include "core/base/small_sort.h"
#include "core/tile/tile.h"

namespace atlas {

void CellLayerBuilder::Build(std::span<const SegmentView> segments) {
  LabelMakers(segments);
  Sum(segments);
  Publish();
  Relabel();
  AdoptWeak(segments);
}

// An obstacle stands on something, even where the height of its foot is a guess: on a layer of its
// own where no other is measured within its deck. Free space at a guessed height is no surface.
bool CellLayerBuilder::IsMaker(const Segment& segment,
                               std::span<const SegmentView> segments) const {
  const auto is_near = [&](const SegmentView& other) {
    const std::int64_t distance_mm =
        std::abs(std::int64_t{other.segment->altitude_mm} - segment.altitude_mm);
    return other.segment->is_strong && distance_mm < profile_.other_layer_mm;
  };
  return profile_.preset == FusionPreset::kPaper || segment.is_strong ||
         (segment.occupancy > 0 && std::none_of(segments.begin(), segments.end(), is_near));
}

// Eq. 1 over the representatives of all sessions. Where they lie as close together as one layer
// always may, there is nothing to sort.
void CellLayerBuilder::LabelMakers(std::span<const SegmentView> segments) {
  labels_.assign(segments.size(), kNoLayer);
  makers_.clear();
  std::int32_t lowest_mm = std::numeric_limits<std::int32_t>::max();
  std::int32_t highest_mm = std::numeric_limits<std::int32_t>::min();
  for (std::uint32_t i = 0; i < segments.size(); ++i) {
    if (IsMaker(*segments[i].segment, segments)) {
      makers_.push_back({segments[i].segment->altitude_mm, i});
      labels_[i] = 0;
      lowest_mm = std::min(lowest_mm, segments[i].segment->altitude_mm);
      highest_mm = std::max(highest_mm, segments[i].segment->altitude_mm);
    }
  }
  if (makers_.empty()) {
    sums_.clear();
    return;
  }
  const std::int64_t always_mm = profile_.preset == FusionPreset::kPaper
                                     ? 0
                                     : std::min(profile_.same_layer_mm, profile_.layer_span_mm);
  if (std::int64_t{highest_mm} - lowest_mm <= always_mm) {
    sums_.assign(1, {});
    sums_[0].reference_mm = lowest_mm;
  } else {
    ChainMakers(segments);
  }
}

void CellLayerBuilder::ChainMakers(std::span<const SegmentView> segments) {
  SmallStableSort(makers_.begin(), makers_.end(),
                  [](const Maker& a, const Maker& b) { return a.altitude_mm < b.altitude_mm; });
  estimates_.clear();
  for (const Maker& maker : makers_) {
    const Segment& segment = *segments[maker.index].segment;
    estimates_.push_back(
        {segment.altitude_mm, sigmas_.Sigma100um(segment.source, segment.distance_step)});
  }
  chain_labels_.resize(makers_.size());
  sums_.assign(ChainLayers(estimates_, profile_, chain_labels_), {});
  for (std::size_t i = makers_.size(); i-- > 0;) {  // the lowest one stays as reference
    labels_[makers_[i].index] = chain_labels_[i];
    sums_[chain_labels_[i]].reference_mm = estimates_[i].altitude_mm;
  }
}

// Eq. 3.
void CellLayerBuilder::Sum(std::span<const SegmentView> segments) {
  std::uint32_t vehicle = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (labels_[i] == kNoLayer) {
      continue;
    }
    const Segment& segment = *segments[i].segment;
    if (segments[i].vehicle != vehicle) {
      CloseVehicle();
      vehicle = segments[i].vehicle;
    }
    LayerSums& sums = sums_[labels_[i]];
    sums.vehicle_weight += segment.weight;
    sums.vehicle_moment +=
        segment.moment + segment.weight * (std::int64_t{segment.reference_mm} - sums.reference_mm);
    sums.observations += segment.observations;
    sums.is_measured |= segment.is_strong;
    sums.last_time_ms = std::max(sums.last_time_ms, segments[i].last_time_ms);
  }
  CloseVehicle();
}

// Adds one vehicle's sums, scaled down to the cap where they exceed it.
void CellLayerBuilder::CloseVehicle() {
  for (LayerSums& sums : sums_) {
    if (sums.vehicle_weight > kVehicleWeightCap) {
      sums.vehicle_moment =
          RoundDiv128(Int128{sums.vehicle_moment} * kVehicleWeightCap, sums.vehicle_weight);
      sums.vehicle_weight = kVehicleWeightCap;
    }
    sums.weight += sums.vehicle_weight;
    sums.moment += sums.vehicle_moment;
    sums.vehicle_weight = 0;
    sums.vehicle_moment = 0;
  }
}

// Lowest first; the best supported ones where there are too many.
void CellLayerBuilder::Publish() {
  published_.clear();
  for (std::uint32_t i = 0; i < sums_.size(); ++i) {
    LayerSums& sums = sums_[i];
    sums.altitude_mm =
        static_cast<std::int32_t>(sums.reference_mm + RoundDiv(sums.moment, sums.weight));
    published_.push_back(i);
  }
  if (published_.size() > kMaxCellLayers) {
    std::stable_sort(published_.begin(), published_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return sums_[a].observations > sums_[b].observations;
    });
    published_.resize(kMaxCellLayers);
  }
  if (published_.size() > 1) {
    std::sort(published_.begin(), published_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return sums_[a].altitude_mm != sums_[b].altitude_mm
                 ? sums_[a].altitude_mm < sums_[b].altitude_mm
                 : a < b;
    });
  }
  layers_.clear();
  for (const std::uint32_t index : published_) {
    const LayerSums& sums = sums_[index];
    layers_.push_back({sums.altitude_mm, sums.reference_mm, sigmas_.SigmaOfWeight100um(sums.weight),
                       sums.is_measured, sums.observations, sums.last_time_ms});
  }
}

// From indices into sums_ to indices into layers_.
void CellLayerBuilder::Relabel() {
  if (sums_.size() == 1) {
    return;
  }
  new_label_.assign(sums_.size(), kNoLayer);
  for (std::uint32_t i = 0; i < published_.size(); ++i) {
    new_label_[published_[i]] = i;
  }
  for (std::uint32_t& label : labels_) {
    label = label == kNoLayer ? kNoLayer : new_label_[label];
  }
}

// Weak segments that make none lend their occupancy and columns to the nearest layer.
void CellLayerBuilder::AdoptWeak(std::span<const SegmentView> segments) {
  if (profile_.preset == FusionPreset::kPaper) {  // there all make layers
    return;
  }
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (!segments[i].segment->is_strong && labels_[i] == kNoLayer) {
      labels_[i] = NearestLayer(segments[i].segment->altitude_mm);
      if (labels_[i] != kNoLayer) {
        CellLayer& layer = layers_[labels_[i]];
        layer.observations += segments[i].segment->observations;
        layer.last_time_ms = std::max(layer.last_time_ms, segments[i].last_time_ms);
      }
    }
  }
}

std::uint32_t CellLayerBuilder::NearestLayer(std::int32_t altitude_mm) const {
  std::uint32_t nearest = kNoLayer;
  std::int64_t nearest_mm = profile_.other_layer_mm;
  for (std::uint32_t i = 0; i < layers_.size(); ++i) {
    const std::int64_t distance_mm = std::abs(std::int64_t{layers_[i].altitude_mm} - altitude_mm);
    if (distance_mm < nearest_mm) {
      nearest = i;
      nearest_mm = distance_mm;
    }
  }
  return nearest;
}

}  // namespace atlas
