// Observations and layers of the reference: eq. 1 to 3.
#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>

#include "core/base/integer_math.h"
#include "core/fusion/cell_layers.h"
#include "tests/core/fusion/reference_cell.h"

namespace atlas::testing {

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

std::set<SessionKey> CellReference::contributors() const {
  std::set<SessionKey> keys;
  for (const Word& word : words_) {
    if (word.layer) {
      keys.insert(word.placed->key.session);
    }
  }
  return keys;
}

}  // namespace atlas::testing
