#include "client/atlas_file/file_feed.h"

#include <chrono>
#include <unordered_set>
#include <utility>

#include "client/vehicle/area_bounds.h"
#include "client/vehicle/area_touch.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;

// One filling of a store, level by level, until the budget or the time ends.
class Filling {
 public:
  Filling(AtlasFile& file, TileStore& store, const MapArea& area, const AroundOptions& options)
      : file_(file),
        store_(store),
        area_(area),
        options_(options),
        end_(Clock::now() + options.deadline) {}

  Result<StoreSyncReport> Run() {
    report_.requests = 1;
    report_.revision = file_.revision();
    for (int level = file_.profile().levels - 1; level >= options_.finest_level && !is_cut_;
         --level) {
      Status status = FillLevel(static_cast<std::uint8_t>(level));
      if (!status.ok()) return Error(std::move(status));
    }
    if (!damage_.ok()) return Error(damage_);
    report_.is_complete = !is_cut_;
    return report_;
  }

 private:
  Status FillLevel(std::uint8_t level) {
    const AreaBounds bounds(area_, file_.profile());
    std::unordered_set<std::uint64_t> there;
    ATLAS_RETURN_IF_ERROR(
        file_.List(level, {bounds.min_m(), bounds.max_m()}, [&](const TileFacts& facts) -> Status {
          if (is_cut_ || !Touches(area_, facts.id, file_.profile())) return {};
          there.insert(facts.id.Key());
          return IsHeld(facts) ? Status() : Take(facts.id);
        }));
    if (!is_cut_) RemoveOthers(level, there);
    return {};
  }

  bool IsHeld(const TileFacts& facts) const {
    const TileFacts* held = store_.Find(facts.id);
    return held != nullptr && held->payload_hash == facts.payload_hash &&
           (options_.sections & ~held->sections) == 0 && !store_.ComesWhole(facts.id);
  }

  Status Take(const TileId& id) {
    if (Clock::now() >= end_) {
      is_cut_ = true;
      return {};
    }
    const Result<TileBlob> tile = file_.ReadListed(id);
    Status status = tile ? Put(*tile) : tile.error();
    if (status.code() != StatusCode::kInvalidData) return status;
    if (damage_.ok()) damage_ = std::move(status);
    return {};
  }

  Status Put(const TileBlob& tile) {
    const std::uint64_t bytes = report_.bytes + tile.blob.size();
    if (options_.budget_bytes != 0 && bytes > options_.budget_bytes) {
      is_cut_ = true;
      return {};
    }
    ATLAS_RETURN_IF_ERROR(store_.Put(tile));
    ++report_.tiles;
    report_.bytes = bytes;
    return {};
  }

  // Held ones that are no more.
  void RemoveOthers(std::uint8_t level, const std::unordered_set<std::uint64_t>& there) {
    for (const TileId& id : store_.Tiles()) {
      const bool is_of_area = id.level == level && Touches(area_, id, file_.profile());
      if (is_of_area && !there.contains(id.Key())) store_.Remove(id);
    }
  }

  AtlasFile& file_;
  TileStore& store_;
  const MapArea& area_;
  const AroundOptions& options_;
  Clock::time_point end_;
  StoreSyncReport report_;
  bool is_cut_ = false;  // by the budget or the time
  Status damage_;        // of the first damaged tile
};

}  // namespace

Result<StoreSyncReport> FileFeed::Sync(TileStore& store,
                                       const MapArea& area,
                                       const AroundOptions& options) {
  if (file_.key() != store.atlas()) {
    return Error(StatusCode::kConflict, "tile store: the file is of another atlas");
  }
  return Filling(file_, store, area, options).Run();
}

}  // namespace atlas
