// What the map holds of one level-0 tile's place: occupied and free segments and surfaces, cell by
// cell. Read once from the finest tile that is there.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/map_profile.h"
#include "core/localization/window/window_grid.h"
#include "core/tile/tile.h"

namespace atlas {

struct ContentOptions {
  std::uint8_t occupied_nibble = 10;  // p >= 0.61
  std::uint8_t free_nibble = 6;       // p <= 0.39: rays passed and none returned
};

class PlaceContent {
 public:
  // Of the level-0 tile `place`, which lies under `tile`; a coarse tile's cells are as many fine
  // ones. Segments are counted from `first_segment` of the world, heights from its lower end.
  void Read(const Tile& tile,
            const TileId& place,
            const MapProfile& profile,
            std::int64_t first_segment,
            const ContentOptions& options);
  // Nothing is known.
  void Clear();

  bool is_empty() const { return begin_.empty(); }
  bool has_occupied() const { return has_occupied_; }
  std::size_t surfaces() const { return heights_m_.size(); }

  // By cell, row-major, bit k segment k; none when empty.
  std::span<const std::uint64_t> occupied() const { return occupied_; }
  std::span<const std::uint64_t> free() const { return free_; }
  bool IsFree(std::size_t cell, int segment) const {
    return !is_empty() && ((free_[cell] >> segment) & 1) != 0;
  }
  // Heights of one cell's traversable layers whose ground was measured, lowest first.
  std::span<const float> SurfacesOf(std::size_t cell) const {
    return is_empty()
               ? std::span<const float>()
               : std::span(heights_m_).subspan(begin_[cell], begin_[cell + 1] - begin_[cell]);
  }

 private:
  struct Lattice;
  void AddColumn(const TileLayer& layer, std::size_t cell, const Lattice& lattice);
  void AddCell(std::span<const TileLayer> layers, std::size_t cell, const Lattice& lattice);

  std::vector<std::uint64_t> occupied_;
  std::vector<std::uint64_t> free_;
  std::vector<std::uint32_t> begin_;  // by cell, plus one
  std::vector<float> heights_m_;
  bool has_occupied_ = false;
};

}  // namespace atlas
