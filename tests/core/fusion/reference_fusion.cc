#include "tests/core/fusion/reference_fusion.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "core/fusion/cell_layers.h"
#include "core/fusion/sigma_table.h"
#include "core/geometry/nibble.h"
#include "core/tile/layer_association.h"

namespace atlas::testing {
namespace {

// One keyframe's word on one cell.
struct Word {
  const PlacedKeyframe* placed = nullptr;
  std::int64_t altitude_mm = 0;
  std::uint16_t distance_step = 0;
  KeyframeCell cell;
  std::uint64_t column = 0;
  std::int64_t column_base = 0;
  std::optional<std::size_t> layer;

  bool is_strong() const { return cell.source != AltitudeSource::kExtrapolated; }
  auto time_order() const { return std::tie(placed->time_ms, placed->key); }
};

struct Layer {
  std::vector<AltitudeEstimate> representatives;
  std::int64_t provisional_mm = 0;
  std::int64_t altitude_mm = 0;
  std::int64_t weight = 0;
};

class CellReference {
 public:
  CellReference(const MapProfile& profile, const SigmaTable& sigmas)
      : profile_(profile), sigmas_(sigmas) {}

  void Look(const PlacedKeyframe& placed, std::int64_t i, std::int64_t j);
  std::vector<TileLayer> Fuse();
  std::set<SessionKey> contributors() const;

 private:
  std::int64_t Weight(const Word& word) const {
    return sigmas_.Weight(word.cell.source, word.distance_step);
  }
  std::vector<Word*> Makers();
  void BuildLayers(const std::vector<Word*>& makers);
  std::vector<Word*> Representatives(const std::vector<Word*>& makers) const;
  void LabelMakers(const std::vector<Word*>& makers, const std::vector<Word*>& representatives);
  std::optional<std::size_t> Nearest(std::int64_t z_mm, std::int64_t Layer::*altitude) const;
  void SumLayers(const std::vector<Word*>& makers);
  void DropUnsupported();
  TileLayer Publish(std::size_t index) const;
  std::int64_t FoldSessions(std::size_t layer, const std::map<const Word*, int>& evidence) const;
  std::uint64_t FoldColumn(std::size_t layer) const;
  int ColumnState(const Word& word, std::size_t layer, int segment) const;

  const MapProfile& profile_;
  const SigmaTable& sigmas_;
  std::vector<Word> words_;
  std::vector<Layer> layers_;
  std::map<const Word*, std::size_t> representative_layer_;
};

void CellReference::Look(const PlacedKeyframe& placed, std::int64_t i, std::int64_t j) {
  const KeyframePlacement& p = placed.placement;
  const Keyframe& keyframe = *placed.keyframe;
  const std::int64_t cell_um = profile_.cell_size_um;
  const std::int64_t cos = p.cos_yaw;
  const std::int64_t sin = p.sin_yaw;
  // In cells x 2^31.
  const std::int64_t u = cos * (2 * i + 1) + sin * (2 * j + 1) -
                         RoundDiv128(2 * (Int128{p.x_um} * cos + Int128{p.y_um} * sin), cell_um);
  const std::int64_t v = cos * (2 * j + 1) - sin * (2 * i + 1) -
                         RoundDiv128(2 * (Int128{p.y_um} * cos - Int128{p.x_um} * sin), cell_um);
  const std::int64_t fine_u = FloorDiv(u, 1 << 15);
  const std::int64_t fine_v = FloorDiv(v, 1 << 15);
  const Int128 squared = Int128{fine_u} * fine_u + Int128{fine_v} * fine_v;
  const std::int64_t radius = keyframe.grid.radius_cells;
  if (squared >= (Int128{radius * radius} << 32)) {
    return;
  }
  const auto ix = static_cast<std::int32_t>(FloorDiv(u, std::int64_t{1} << 31));
  const auto iy = static_cast<std::int32_t>(FloorDiv(v, std::int64_t{1} << 31));
  const std::size_t index = keyframe.grid.Index(ix, iy);
  if (keyframe.cells[index].source == AltitudeSource::kNone) {
    return;
  }
  Word word;
  word.placed = &placed;
  word.cell = keyframe.cells[index];
  word.distance_step = sigmas_.Step(static_cast<std::size_t>(squared >> 32));
  const std::int64_t slope = p.slope_x * (2 * ix + 1) + p.slope_y * (2 * iy + 1);
  const std::int64_t tilt_um = FloorDiv(slope * cell_um, std::int64_t{1} << 31);
  word.altitude_mm = RoundDiv(p.z_um + 1'000 * word.cell.altitude_mm + tilt_um, 1'000);
  word.column = keyframe.columns[index];
  word.column_base =
      RoundDiv(word.altitude_mm - word.cell.altitude_mm, profile_.segment_height_mm) +
      keyframe.anchors[keyframe.BlockIndex(ix, iy)];
  words_.push_back(word);
}

std::vector<Word*> CellReference::Makers() {
  const bool any_strong =
      std::any_of(words_.begin(), words_.end(), [](const Word& w) { return w.is_strong(); });
  std::vector<Word*> makers;
  for (Word& word : words_) {
    if (word.is_strong() || !any_strong) {
      makers.push_back(&word);
    }
  }
  return makers;
}

std::vector<Word*> CellReference::Representatives(const std::vector<Word*>& makers) const {
  std::vector<std::vector<Word*>> segments;
  for (Word* word : makers) {
    const Word* last = segments.empty() ? nullptr : segments.back().back();
    const bool continues =
        last != nullptr && last->placed->key.session == word->placed->key.session &&
        word->placed->key.sequence - last->placed->key.sequence <= profile_.sequence_gap &&
        std::abs(word->altitude_mm - last->altitude_mm) < profile_.other_layer_mm;
    if (!continues) {
      segments.emplace_back();
    }
    segments.back().push_back(word);
  }
  std::vector<Word*> representatives;
  for (const auto& segment : segments) {
    representatives.push_back(
        *std::min_element(segment.begin(), segment.end(), [](const Word* a, const Word* b) {
          return std::pair(a->distance_step, a->placed->key.sequence) <
                 std::pair(b->distance_step, b->placed->key.sequence);
        }));
  }
  return representatives;
}

// Eq. 1.
void CellReference::BuildLayers(const std::vector<Word*>& makers) {
  std::vector<Word*> sorted = Representatives(makers);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Word* a, const Word* b) { return a->altitude_mm < b->altitude_mm; });
  for (Word* word : sorted) {
    const AltitudeEstimate next{static_cast<std::int32_t>(word->altitude_mm),
                                sigmas_.Sigma_100um(word->cell.source, word->distance_step)};
    bool is_same = false;
    if (!layers_.empty()) {
      const auto& of_layer = layers_.back().representatives;
      const int step = next.altitude_mm - of_layer.back().altitude_mm;
      const int span = next.altitude_mm - of_layer.front().altitude_mm;
      is_same = span <= profile_.layer_span_mm &&
                (step <= profile_.same_layer_mm ||
                 (step < profile_.other_layer_mm && OverlapsAsOneLayer(of_layer.back(), next)));
    }
    if (!is_same) {
      layers_.emplace_back();
    }
    layers_.back().representatives.push_back(next);
    layers_.back().weight += Weight(*word);
    layers_.back().provisional_mm += Weight(*word) * word->altitude_mm;
    representative_layer_[word] = layers_.size() - 1;
  }
  for (Layer& layer : layers_) {
    layer.provisional_mm = RoundDiv(layer.provisional_mm, layer.weight);
  }
}

std::optional<std::size_t> CellReference::Nearest(std::int64_t z_mm,
                                                  std::int64_t Layer::*altitude) const {
  std::optional<std::size_t> nearest;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const std::int64_t distance = std::abs(layers_[i].*altitude - z_mm);
    if (distance < profile_.other_layer_mm &&
        (!nearest || distance < std::abs(layers_[*nearest].*altitude - z_mm))) {
      nearest = i;
    }
  }
  return nearest;
}

// Eq. 2 with the gate.
void CellReference::LabelMakers(const std::vector<Word*>& makers,
                                const std::vector<Word*>& representatives) {
  for (Word* word : makers) {
    const Word* before = nullptr;
    const Word* after = nullptr;
    for (const Word* other : representatives) {
      if (other->placed->key.session != word->placed->key.session) {
        continue;
      }
      if (other->placed->key.sequence <= word->placed->key.sequence) {
        before = other;
      } else if (after == nullptr) {
        after = other;
      }
    }
    const Word* chosen = before;
    if (before == nullptr ||
        (after != nullptr && std::abs(after->altitude_mm - word->altitude_mm) <
                                 std::abs(before->altitude_mm - word->altitude_mm))) {
      chosen = after;
    }
    const std::size_t layer = representative_layer_.at(chosen);
    const std::int64_t distance = std::abs(layers_[layer].provisional_mm - word->altitude_mm);
    word->layer = distance < profile_.other_layer_mm
                      ? std::optional(layer)
                      : Nearest(word->altitude_mm, &Layer::provisional_mm);
  }
}

// Eq. 3, one vehicle at a time for the cap.
void CellReference::SumLayers(const std::vector<Word*>& makers) {
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    Layer& layer = layers_[i];
    const std::int64_t reference = layer.representatives.front().altitude_mm;
    std::map<std::string, std::pair<std::int64_t, std::int64_t>> vehicles;
    for (const Word* word : makers) {
      if (word->layer == i) {
        auto& [weight, moment] = vehicles[word->placed->key.session.vehicle];
        weight += Weight(*word);
        moment += Weight(*word) * (word->altitude_mm - reference);
      }
    }
    layer.weight = 0;
    std::int64_t moment = 0;
    for (auto& [name, sums] : vehicles) {
      if (sums.first > kVehicleWeightCap) {
        sums.second = RoundDiv128(Int128{sums.second} * kVehicleWeightCap, sums.first);
        sums.first = kVehicleWeightCap;
      }
      layer.weight += sums.first;
      moment += sums.second;
    }
    layer.altitude_mm = layer.weight == 0 ? 0 : reference + RoundDiv(moment, layer.weight);
  }
}

// Renumbers what is left, lowest first.
void CellReference::DropUnsupported() {
  std::vector<std::size_t> order;
  std::map<std::size_t, int> support;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    support[i] = static_cast<int>(
        std::count_if(words_.begin(), words_.end(), [i](const Word& w) { return w.layer == i; }));
    if (support[i] > 0) {
      order.push_back(i);
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return support[a] > support[b]; });
  order.resize(std::min(order.size(), kMaxCellLayers));
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(layers_[a].altitude_mm, a) < std::pair(layers_[b].altitude_mm, b);
  });
  std::vector<Layer> kept;
  for (const std::size_t i : order) {
    kept.push_back(layers_[i]);
  }
  for (Word& word : words_) {
    if (word.layer) {
      const auto found = std::find(order.begin(), order.end(), *word.layer);
      word.layer = found == order.end()
                       ? std::nullopt
                       : std::optional(static_cast<std::size_t>(found - order.begin()));
    }
  }
  layers_ = kept;
}

std::vector<TileLayer> CellReference::Fuse() {
  std::sort(words_.begin(), words_.end(),
            [](const Word& a, const Word& b) { return a.placed->key < b.placed->key; });
  const std::vector<Word*> makers = Makers();
  const std::vector<Word*> representatives = Representatives(makers);
  BuildLayers(makers);
  LabelMakers(makers, representatives);
  SumLayers(makers);
  DropUnsupported();
  for (Word& word : words_) {
    if (std::find(makers.begin(), makers.end(), &word) == makers.end()) {
      word.layer = Nearest(word.altitude_mm, &Layer::altitude_mm);
    }
  }
  std::vector<TileLayer> published;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    published.push_back(Publish(i));
  }
  return published;
}

// Saturating folds: each session's words in time order, sessions in order of their last word.
std::int64_t CellReference::FoldSessions(std::size_t layer,
                                         const std::map<const Word*, int>& evidence) const {
  std::map<SessionKey, std::vector<const Word*>> sessions;
  for (const Word& word : words_) {
    if (word.layer == layer) {
      sessions[word.placed->key.session].push_back(&word);
    }
  }
  std::vector<std::pair<const Word*, int>> increments;
  for (auto& [key, words] : sessions) {
    std::sort(words.begin(), words.end(),
              [](const Word* a, const Word* b) { return a->time_order() < b->time_order(); });
    int sum = 0;
    for (const Word* word : words) {
      const auto found = evidence.find(word);
      sum = std::clamp<int>(sum + (found == evidence.end() ? 0 : found->second),
                            -profile_.session_clamp, profile_.session_clamp);
    }
    increments.emplace_back(words.back(), sum);
  }
  std::sort(increments.begin(), increments.end(), [](const auto& a, const auto& b) {
    return a.first->time_order() < b.first->time_order();
  });
  int total = 0;
  for (const auto& [last, sum] : increments) {
    total = std::clamp<int>(total + sum, -profile_.evidence_clamp, profile_.evidence_clamp);
  }
  return total;
}

// What `word` says about a segment of the layer's column; 0: nothing, or nothing that counts.
int CellReference::ColumnState(const Word& word, std::size_t layer, int segment) const {
  const std::int64_t height = profile_.segment_height_mm;
  const std::int64_t index =
      ColumnBaseIndex(static_cast<std::int32_t>(layers_[layer].altitude_mm), profile_) + segment;
  const bool reaches_next =
      layer + 1 < layers_.size() &&
      (index + 1) * height > layers_[layer + 1].altitude_mm - profile_.slab_margin_mm;
  const std::int64_t nibble = index - word.column_base;
  if (reaches_next || nibble < 0 || nibble >= profile_.column_segments) {
    return 0;
  }
  return static_cast<int>((word.column >> (4 * nibble)) & 15);
}

std::uint64_t CellReference::FoldColumn(std::size_t layer) const {
  std::uint64_t column = 0;
  for (int segment = 0; segment < profile_.column_segments; ++segment) {
    std::map<const Word*, int> evidence;
    for (const Word& word : words_) {
      const int state = word.layer == layer ? ColumnState(word, layer, segment) : 0;
      if (state != 0) {
        evidence[&word] = kNibbleEvidence[static_cast<std::size_t>(state)];
      }
    }
    if (!evidence.empty()) {
      const auto total = static_cast<int>(FoldSessions(layer, evidence));
      column |= std::uint64_t{NibbleFromEvidence(total)} << (4 * segment);
    }
  }
  return column;
}

TileLayer CellReference::Publish(std::size_t index) const {
  std::map<const Word*, int> occupancy;
  int observations = 0;
  bool is_measured = false;
  for (const Word& word : words_) {
    if (word.layer == index) {
      ++observations;
      is_measured |= word.is_strong();
      occupancy[&word] = word.cell.occupancy == Occupancy::kObstacle ? profile_.hit_units
                         : word.cell.occupancy == Occupancy::kFree   ? profile_.miss_units
                                                                     : 0;
    }
  }
  TileLayer layer;
  layer.altitude_mm = static_cast<std::int32_t>(layers_[index].altitude_mm);
  layer.sigma_100um = sigmas_.SigmaOfWeight_100um(layers_[index].weight);
  layer.occupancy = static_cast<std::int8_t>(FoldSessions(index, occupancy));
  layer.observations = static_cast<std::uint16_t>(std::min(observations, 65'535));
  layer.flags = static_cast<std::uint8_t>(
      (layer.occupancy < 0 ? TileLayer::kTraversable + TileLayer::kTraversableAny : 0) +
      (is_measured ? TileLayer::kMeasured : 0));
  layer.column = FoldColumn(index);
  return layer;
}

std::set<SessionKey> CellReference::contributors() const {
  std::set<SessionKey> keys;
  for (const Word& word : words_) {
    if (word.layer) {
      keys.insert(word.placed->key.session);
    }
  }
  return keys;
}

}  // namespace

Tile ReferenceFuseTile(const TileId& id,
                       std::span<const PlacedKeyframe> keyframes,
                       const MapProfile& profile) {
  std::int32_t max_radius = 1;
  for (const PlacedKeyframe& placed : keyframes) {
    max_radius = std::max(max_radius, placed.keyframe->grid.radius_cells);
  }
  const SigmaTable sigmas(profile, max_radius);
  const std::int64_t side = profile.tile_cells;
  std::set<SessionKey> contributors;
  Tile tile = EmptyTile(id, profile);
  for (std::int64_t cell = 0; cell < side * side; ++cell) {
    CellReference reference(profile, sigmas);
    for (const PlacedKeyframe& placed : keyframes) {
      reference.Look(placed, id.x * side + cell % side, id.y * side + cell / side);
    }
    const std::vector<TileLayer> layers = reference.Fuse();
    tile.layers.insert(tile.layers.end(), layers.begin(), layers.end());
    tile.cell_begin[static_cast<std::size_t>(cell) + 1] =
        static_cast<std::uint32_t>(tile.layers.size());
    contributors.merge(reference.contributors());
  }
  tile.contributors.assign(contributors.begin(), contributors.end());
  return tile;
}

}  // namespace atlas::testing
