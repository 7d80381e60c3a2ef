// Where the tiles of a map come from: a daemon (daemon_source.h) or an atlas file
// (client/atlas_file).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "client/connection/requests.h"
#include "client/connection/sync_query.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

class MapSource {
 public:
  using OnTile = std::function<Status(const TileBlob&)>;

  MapSource() = default;
  MapSource(const MapSource&) = delete;
  MapSource& operator=(const MapSource&) = delete;
  MapSource(MapSource&&) = default;
  MapSource& operator=(MapSource&&) = default;
  virtual ~MapSource() = default;

  virtual const MapProfile& profile() const = 0;
  // Calls back once for every tile of `level` that the disc touches, and maybe for some beside it;
  // without a disc for all of the level. What a blob says is the caller's to check. A failing
  // callback, which must not read from the source, ends it with its status; kInvalidArgument: there
  // is no such level; else the source's own errors.
  virtual Status ReadLevel(std::uint8_t level,
                           const std::optional<DiscArea>& disc,
                           const OnTile& on_tile) = 0;
};

}  // namespace atlas
