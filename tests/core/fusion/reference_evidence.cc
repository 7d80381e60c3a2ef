// Occupancy and columns of the reference.
#include <algorithm>
#include <utility>

#include "core/base/integer_math.h"
#include "core/geometry/nibble.h"
#include "tests/core/fusion/reference_cell.h"

namespace atlas::testing {
namespace {

constexpr int kDriven = -1000;  // the vehicle itself was there

int EvidenceOfState(int state) {
  return state == kNibbleFree ? kDriven : kNibbleEvidence[static_cast<std::size_t>(state)];
}

}  // namespace

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
      const int added = found == evidence.end() ? 0 : found->second;
      const int floor = std::min<int>(sum, -profile_.session_clamp);
      sum = added == kDriven ? -profile_.driven_clamp
                             : std::clamp<int>(sum + added, floor, profile_.session_clamp);
    }
    increments.emplace_back(words.back(),
                            std::clamp<int>(sum, -profile_.session_clamp, profile_.session_clamp));
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
        evidence.emplace(&word, EvidenceOfState(state));
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
  layer.sigma_100um = sigmas_.SigmaOfWeight100um(layers_[index].weight);
  layer.occupancy = static_cast<std::int8_t>(FoldSessions(index, occupancy));
  layer.observations = static_cast<std::uint16_t>(std::min(observations, 65'535));
  layer.flags = static_cast<std::uint8_t>(
      (layer.occupancy < 0 ? TileLayer::kTraversable + TileLayer::kTraversableAny : 0) +
      (is_measured ? TileLayer::kMeasured : 0));
  layer.column = FoldColumn(index);
  return layer;
}

}  // namespace atlas::testing
