// What changed in an area since its watcher was told last: the newest revision of each tile, and no
// more than some. Of a watcher that does not keep up, the finest tiles become "something below this
// one": it loses detail, and costs no memory. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <vector>

#include "core/geometry/tile_id.h"
#include "server/service/sync/sync_area.h"
#include "server/service/sync/touched_tiles.h"

namespace atlas {

struct TileChanges {
  struct Tile {
    TileId id;
    std::uint64_t revision = 0;  // 0: it is no more

    friend bool operator==(const Tile&, const Tile&) = default;
  };
  std::vector<Tile> tiles;    // coarse ones last
  std::vector<TileId> below;  // of these, some finer tiles
  bool is_anything = false;   // more than can be told: look at all of it

  bool empty() const { return tiles.empty() && below.empty() && !is_anything; }
};

class TileWatch {
 public:
  struct Scope {
    SyncArea area;
    std::uint32_t finest_level = 0;
    std::uint32_t coarsest_level = 0;  // that there is, or is asked for
  };

  // `wake` is called, from whatever thread, when there is something again after Take().
  TileWatch(Scope scope, std::function<void()> wake, std::size_t max_told = 1'024);

  // What has no later revision is not told: whoever looks finds it. It may still be on its way here
  // from the thread that wrote it.
  void TellFrom(std::uint64_t revision);
  // Revision 0: the tile is no more.
  void Add(const TileId& id, std::uint64_t revision);
  // Everything since the last time.
  TileChanges Take();

 private:
  bool IsOld(std::uint64_t revision) const { return revision != 0 && revision <= since_; }
  bool IsBelow(const TileId& id) const;
  void LoseDetail();
  void CoarsenTiles();
  void CoarsenBelow();

  const std::uint32_t coarsest_level_;
  const std::function<void()> wake_;
  const std::size_t max_told_;
  std::mutex mutex_;
  TouchedTiles asked_;
  std::uint64_t since_ = 0;
  std::map<std::uint64_t, std::uint64_t> revisions_;  // by tile; finer levels have smaller keys
  std::set<std::uint64_t> below_;
  bool is_anything_ = false;
};

}  // namespace atlas
