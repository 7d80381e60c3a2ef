// The tiles of one state of the atlas, for whoever reads some of them: the current one
// (current_tiles.h) or an earlier one (history/past_view.h).
#pragma once

#include <functional>
#include <optional>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "server/store/store_types.h"

namespace atlas {

class TileView {
 public:
  TileView() = default;
  TileView(const TileView&) = delete;
  TileView& operator=(const TileView&) = delete;
  virtual ~TileView() = default;

  virtual const MapProfile& profile() const = 0;
  // Calls `visit` for every tile in the rectangle, in key order, and maybe for some that turn out
  // to be empty when they are read.
  virtual Status Scan(const TileRect& rect, const std::function<void(const TileId&)>& visit) = 0;
  // nullopt: there is no such tile.
  virtual Result<std::optional<StoredTile>> Read(const TileId& id) = 0;
};

}  // namespace atlas
