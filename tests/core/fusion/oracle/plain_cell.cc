#include "tests/core/fusion/oracle/plain_cell.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <tuple>

#include "core/base/integer_math.h"
#include "core/fusion/combination/cell_layers.h"
#include "core/geometry/nibble.h"
#include "core/tile/layer_association.h"

namespace atlas::testing {
namespace {

// A later stretch's say on top of what was known.
int Folded(int sum, int said, const MapProfile& profile) {
  if (said == 0) {
    return sum;
  }
  const int say = std::clamp<int>(said, -profile.stretch_clamp, profile.stretch_clamp);
  const int carried = std::clamp<int>(sum, -profile.carry_clamp, profile.carry_clamp);
  return std::clamp<int>(carried + say, -profile.evidence_clamp, profile.evidence_clamp);
}

struct TimedSay {
  const PlacedKeyframe* last;
  const PlacedKeyframe* driven;
  int units;
};

}  // namespace

// What the says so far add up to, of a surface or of a segment of its column.
class PlainSum {
 public:
  explicit PlainSum(const MapProfile& profile) : profile_(profile) {}

  // By time; hits do not count for a while after the session's vehicle was there itself. What it
  // counted for.
  int Add(const TimedSay& say) {
    const bool follows_vehicle =
        std::any_of(says_.begin(), says_.end(), [&](const TimedSay& before) {
          return IsStretchsLastWord(before.units, profile_) &&
                 before.last->key.session == say.last->key.session &&
                 say.last->time_ms - std::min(before.driven->time_ms, before.last->time_ms) <=
                     profile_.driven_hold_ms;
        });
    says_.push_back(say);
    const int counted = follows_vehicle ? std::min(say.units, 0) : say.units;
    units_ = Folded(units_, counted, profile_);
    return counted;
  }
  void DropHits() { units_ = std::min(units_, 0); }
  int units() const { return units_; }
  bool is_told() const { return !says_.empty(); }

 private:
  const MapProfile& profile_;
  std::vector<TimedSay> says_;
  int units_ = 0;
};

void PlainCell::Fuse(std::span<const PlainObservation> observations,
                     std::set<const SessionKey*>& used,
                     std::vector<TileLayer>& out) {
  segments_ = survey_.Find(observations);
  if (profile_.preset == FusionPreset::kBounded) {
    KeepLatest();
  }
  ChainLayers();
  for (Layer& layer : layers_) {
    SumLayer(layer);
  }
  KeepBestLayers();
  if (profile_.preset != FusionPreset::kPaper) {
    AdoptWeak();
  }
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    out.push_back(Publish(i));
  }
  for (const Segment& segment : segments_) {
    if (segment.layer >= 0) {
      used.insert(&segment.first->key.session);
    }
  }
}

// Preset bounded: in each band of altitude the stretches that saw it last, so many of a vehicle;
// where they measured it before those that guessed.
void PlainCell::KeepLatest() {
  std::vector<Segment*> preferred_first;
  for (Segment& segment : segments_) {
    segment.is_kept = false;
    preferred_first.push_back(&segment);
  }
  std::stable_sort(preferred_first.begin(), preferred_first.end(),
                   [](const Segment* a, const Segment* b) {
                     return std::tuple(a->is_strong, a->last->time_ms, a->last->key) >
                            std::tuple(b->is_strong, b->last->time_ms, b->last->key);
                   });
  const auto band = [&](const Segment& s) {
    return FloorDiv(s.representative->altitude_mm, profile_.band_mm);
  };
  for (Segment* segment : preferred_first) {
    int of_all = 0;
    int of_vehicle = 0;
    for (const Segment* other : preferred_first) {
      if (other->is_kept && band(*other) == band(*segment)) {
        ++of_all;
        of_vehicle += other->first->key.session.vehicle == segment->first->key.session.vehicle;
      }
    }
    segment->is_kept =
        of_all < profile_.band_segments && of_vehicle < profile_.band_vehicle_segments;
  }
}

// No strong segment is of its deck.
bool PlainCell::IsAlone(const Segment& segment) const {
  return std::none_of(segments_.begin(), segments_.end(), [&](const Segment& other) {
    return other.is_kept && other.is_strong &&
           std::abs(std::int64_t{other.representative->altitude_mm} -
                    segment.representative->altitude_mm) < profile_.other_layer_mm;
  });
}

// Eq. 1.
void PlainCell::ChainLayers() {
  const bool all_make = profile_.preset == FusionPreset::kPaper;
  makers_.clear();
  layers_.clear();
  for (Segment& segment : segments_) {
    segment.layer = -1;
    if (segment.is_kept &&
        (all_make || segment.is_strong || (segment.occupancy > 0 && IsAlone(segment)))) {
      makers_.push_back(&segment);
    }
  }
  // Where altitudes are equal by stretch, and of each what it saw last first.
  std::stable_sort(makers_.begin(), makers_.end(), [](const Segment* a, const Segment* b) {
    return std::tuple(a->representative->altitude_mm, a->representative->stretch,
                      b->last->key.sequence) < std::tuple(b->representative->altitude_mm,
                                                          b->representative->stretch,
                                                          a->last->key.sequence);
  });
  const auto estimate = [&](const Segment& s) {
    return AltitudeEstimate{
        s.representative->altitude_mm,
        sigmas_.Sigma100um(s.representative->source, s.representative->distance_step)};
  };
  const Segment* lowest = nullptr;
  const Segment* previous = nullptr;
  for (Segment* segment : makers_) {
    const AltitudeEstimate next = estimate(*segment);
    bool is_same = false;
    if (previous != nullptr) {
      const std::int64_t step = next.altitude_mm - estimate(*previous).altitude_mm;
      const std::int64_t span = next.altitude_mm - estimate(*lowest).altitude_mm;
      const bool overlaps = OverlapsAsOneLayer(estimate(*previous), next);
      is_same =
          profile_.preset == FusionPreset::kPaper
              ? overlaps
              : span <= profile_.layer_span_mm && (step <= profile_.same_layer_mm ||
                                                   (step < profile_.other_layer_mm && overlaps));
    }
    if (!is_same) {
      layers_.push_back({static_cast<int>(layers_.size())});
      lowest = segment;
    }
    segment->layer = layers_.back().chained;
    previous = segment;
  }
}

// Eq. 3, one vehicle at a time for the cap.
void PlainCell::SumLayer(Layer& layer) const {
  std::int64_t reference_mm = 0;  // the lowest representative's altitude
  for (const Segment* segment : makers_) {
    if (segment->layer == layer.chained) {
      reference_mm = segment->representative->altitude_mm;
      break;
    }
  }
  std::int64_t moment = 0;
  for (std::size_t i = 0; i < segments_.size();) {
    std::int64_t vehicle_weight = 0;
    std::int64_t vehicle_moment = 0;
    const std::string& vehicle = segments_[i].first->key.session.vehicle;
    for (; i < segments_.size() && segments_[i].first->key.session.vehicle == vehicle; ++i) {
      const Segment& segment = segments_[i];
      if (segment.layer == layer.chained) {
        vehicle_weight += segment.weight;
        vehicle_moment += segment.weighted_mm - segment.weight * reference_mm;
        layer.observations += segment.observations;
        layer.time_ms = std::max(layer.time_ms, segment.last->time_ms);
        layer.is_measured |= segment.is_strong;
      }
    }
    if (vehicle_weight > kVehicleWeightCap) {
      vehicle_moment = RoundDiv128(Int128{vehicle_moment} * kVehicleWeightCap, vehicle_weight);
      vehicle_weight = kVehicleWeightCap;
    }
    layer.weight += vehicle_weight;
    moment += vehicle_moment;
  }
  layer.altitude_mm = reference_mm + RoundDiv(moment, layer.weight);
}

void PlainCell::KeepBestLayers() {
  std::stable_sort(layers_.begin(), layers_.end(),
                   [](const Layer& a, const Layer& b) { return a.observations > b.observations; });
  layers_.resize(std::min(layers_.size(), kMaxCellLayers));
  std::sort(layers_.begin(), layers_.end(), [](const Layer& a, const Layer& b) {
    return std::pair(a.altitude_mm, a.chained) < std::pair(b.altitude_mm, b.chained);
  });
  for (Segment& segment : segments_) {
    const auto found = std::find_if(layers_.begin(), layers_.end(), [&](const Layer& layer) {
      return layer.chained == segment.layer;
    });
    segment.layer = found == layers_.end() ? -1 : static_cast<int>(found - layers_.begin());
  }
}

void PlainCell::AdoptWeak() {
  for (Segment& segment : segments_) {
    if (!segment.is_kept || segment.is_strong || segment.layer >= 0) {
      continue;
    }
    std::int64_t nearest_mm = profile_.other_layer_mm;
    for (std::size_t i = 0; i < layers_.size(); ++i) {
      const std::int64_t distance_mm =
          std::abs(layers_[i].altitude_mm - segment.representative->altitude_mm);
      if (distance_mm < nearest_mm) {
        nearest_mm = distance_mm;
        segment.layer = static_cast<int>(i);
      }
    }
    if (segment.layer >= 0) {
      Layer& layer = layers_[static_cast<std::size_t>(segment.layer)];
      layer.observations += segment.observations;
      layer.time_ms = std::max(layer.time_ms, segment.last->time_ms);
    }
  }
}

TileLayer PlainCell::Publish(std::size_t index) const {
  std::vector<const Segment*> in_order;
  for (const Segment& segment : segments_) {
    if (segment.layer == static_cast<int>(index)) {
      in_order.push_back(&segment);
    }
  }
  std::stable_sort(in_order.begin(), in_order.end(), [](const Segment* a, const Segment* b) {
    return std::tie(a->last->time_ms, a->last->key) < std::tie(b->last->time_ms, b->last->key);
  });
  const Layer& layer = layers_[index];
  const std::int32_t base = ColumnBaseIndex(static_cast<std::int32_t>(layer.altitude_mm), profile_);
  PlainSum surface(profile_);
  std::vector<PlainSum> column(PublishedSegments(index, base), PlainSum(profile_));
  bool has_foot = false;
  for (const Segment* segment : in_order) {
    has_foot |= surface.units() > 0;
    const bool is_wrong_guess =
        profile_.preset != FusionPreset::kPaper && layer.is_measured && !segment->is_strong &&
        std::abs(segment->representative->altitude_mm - layer.altitude_mm) > profile_.same_layer_mm;
    if (!is_wrong_guess) {
      surface.Add({segment->last, segment->driven, segment->occupancy});
    }
    const bool is_foot_gone = profile_.preset != FusionPreset::kPaper && segment->is_strong &&
                              has_foot && surface.units() < 0;
    has_foot &= !is_foot_gone;
    AddToColumn(*segment, base, is_foot_gone, column);
  }
  const int occupancy = surface.units();
  TileLayer out;
  out.altitude_mm = static_cast<std::int32_t>(layer.altitude_mm);
  out.sigma_100um = sigmas_.SigmaOfWeight100um(layer.weight);
  out.occupancy = static_cast<std::int8_t>(occupancy);
  out.flags = static_cast<std::uint8_t>(
      (occupancy < 0 ? TileLayer::kTraversable + TileLayer::kTraversableAny : 0) +
      (layer.is_measured ? TileLayer::kMeasured : 0));
  out.observations = static_cast<std::uint16_t>(std::min<std::int64_t>(layer.observations, 65'535));
  out.confirmed_s = static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(FloorDiv(layer.time_ms, 1'000), 0, 0xFFFFFFFF));
  for (std::size_t k = 0; k < column.size(); ++k) {
    if (column[k].is_told()) {
      out.column |= std::uint64_t{NibbleFromEvidence(column[k].units())} << (4 * k);
    }
  }
  return out;
}

// Up to the slab of the next layer.
std::size_t PlainCell::PublishedSegments(std::size_t index, std::int64_t base) const {
  int segments = 0;
  while (segments < profile_.column_segments &&
         (index + 1 == layers_.size() ||
          (base + segments + 1) * profile_.segment_height_mm <=
              layers_[index + 1].altitude_mm - profile_.slab_margin_mm)) {
    ++segments;
  }
  return static_cast<std::size_t>(segments);
}

// And where the foot of what stood there is gone, so is the rest of it, unless some of it was seen.
void PlainCell::AddToColumn(const Segment& segment,
                            std::int64_t base,
                            bool is_foot_gone,
                            std::span<PlainSum> column) const {
  std::array<int, 16> before{};
  std::array<int, 16> said{};
  for (std::size_t k = 0; k < column.size(); ++k) {
    before[k] = column[k].units();
    const std::int64_t own = base + static_cast<std::int64_t>(k) - segment.column_base;
    if (own >= 0 && own < 16 && segment.is_seen[static_cast<std::size_t>(own)]) {
      const int units = segment.column[static_cast<std::size_t>(own)];
      said[k] = column[k].Add({segment.last, segment.driven, units});
    }
  }
  if (!is_foot_gone || column.empty()) {
    return;
  }
  const std::size_t begin = before[0] > 0 ? 0 : 1;  // the lowest one may be free: most was above
  std::size_t end = begin;
  bool is_seen = false;
  for (; end < column.size() && before[end] > 0; ++end) {
    is_seen |= said[end] > 0;
  }
  for (std::size_t k = begin; k < end && !is_seen; ++k) {
    column[k].DropHits();
  }
}

}  // namespace atlas::testing
