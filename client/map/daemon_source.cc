#include "client/map/daemon_source.h"

namespace atlas {

Status DaemonSource::ReadLevel(std::uint8_t level,
                               const std::optional<DiscArea>& disc,
                               const OnTile& on_tile) {
  RegionQuery query;
  query.finest_level = level;
  query.is_only_finest = true;
  query.at_revision = at_revision_;
  if (disc) query.disc = {disc->center_m, disc->radius_m};
  const auto summary =
      client_.QueryRegion(query, [&on_tile](const TileBlob& tile) { return on_tile(tile); });
  return summary ? Status() : summary.error();
}

}  // namespace atlas
