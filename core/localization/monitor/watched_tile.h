// A level-0 tile while a vehicle is near it: what scans said about its columns.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/map_profile.h"
#include "core/localization/monitor/contradiction.h"
#include "core/localization/monitor/segment_evidence.h"
#include "core/localization/monitor/sight_lines.h"
#include "core/tile/tile.h"

namespace atlas {

struct WatchOptions {
  std::uint8_t occupied_nibble = 10;  // p >= 0.61, as the localizer's map (MapWindowOptions)
  std::uint8_t free_nibble = 6;       // p <= 0.39
};

using ContextOfPlace = std::function<PlaceContext(const Eigen::Vector3d& p_world)>;

class WatchedTile {
 public:
  WatchedTile(std::shared_ptr<const Tile> tile,
              const MapProfile& profile,
              const WatchOptions& options);

  const TileId& id() const { return tile_->id; }
  std::span<const TileLayer> Layers(std::size_t cell) const { return tile_->Layers(cell); }

  // Something was measured in a segment (of the world's lattice) that the map says is free.
  // `layer`: that it belongs to.
  void AddAppearance(std::size_t cell,
                     const TileLayer& layer,
                     std::int32_t segment,
                     std::uint8_t halves,
                     std::uint32_t scan);
  // What a scan says of all that is watched; after its appearances.
  void Observe(const SightLines& sight, std::uint32_t scan);

  // What contradicts the map, by cell (row-major), upwards.
  void Report(const EvidenceOptions& options,
              const ContextOfPlace& context_of,
              const OnContradiction& on_contradiction) const;

 private:
  // Occupied segments of one layer at one cell.
  struct Column {
    std::uint32_t cell = 0;
    std::int32_t base = 0;         // lattice index of bit 0
    std::uint32_t segments = 0;    // that are occupied
    std::uint32_t first = 0;       // of their evidence
    std::int32_t altitude_mm = 0;  // of the layer
    std::uint8_t calm = 0;         // looks in a row at which all that was seen of it stood there
    bool is_hidden = false;        // nothing was seen of it at the last look
  };
  struct Appearance {
    std::uint32_t cell = 0;
    std::int32_t segment = 0;
    std::int32_t altitude_mm = 0;
    FreeEvidence evidence;
  };

  // Its own evidence and that of the cells around it, which what appeared covers, too.
  EvidenceSum HitsAround(const Appearance& appearance) const;
  std::vector<Contradiction> Vanished(const EvidenceOptions& options) const;
  Eigen::Vector3d PlaceOf(std::uint32_t cell, std::int32_t segment) const;
  bool IsDue(const Column& column) const;
  Eigen::Vector2f OffsetOf(std::uint32_t cell, const Eigen::Vector2f& corner) const;
  float FootOf(std::int32_t altitude_mm, double sensor_z_m) const;
  // Of a segment: those above the ground.
  std::uint8_t HalvesOf(const Column& column, int segment) const;
  Contradiction ContradictionAt(std::uint32_t cell,
                                std::int32_t altitude_mm,
                                std::int32_t segment,
                                const Verdict& verdict) const;

  std::shared_ptr<const Tile> tile_;
  MapProfile profile_;
  std::uint32_t looks_ = 0;
  std::vector<Column> columns_;
  std::vector<OccupiedEvidence> occupied_;
  std::vector<Appearance> appearances_;
  std::unordered_map<std::uint64_t, std::uint32_t> appearance_at_;  // by cell and segment
};

// Whether what stands in a cell stands on the layer, not at a height that was guessed where others
// were measured.
bool IsBelieved(const TileLayer& layer, std::span<const TileLayer> cell);

}  // namespace atlas
