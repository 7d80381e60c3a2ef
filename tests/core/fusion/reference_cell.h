// One cell of the reference fusion: its observations, its layers, its evidence, each rule by
// itself.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "core/fusion/sigma_table.h"
#include "core/fusion/tile_fusion.h"
#include "core/tile/layer_association.h"

namespace atlas::testing {

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

}  // namespace atlas::testing
