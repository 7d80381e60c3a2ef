// The tiles of a map as a daemon serves them, each as it is when it is asked for.
#pragma once

#include <cstdint>
#include <optional>

#include "client/connection/atlas_client.h"
#include "client/map/map_source.h"

namespace atlas {

class DaemonSource final : public MapSource {
 public:
  // With a revision: as the atlas was then, fused again for each reading. The client outlives it.
  explicit DaemonSource(AtlasClient& client,
                        std::optional<std::uint64_t> at_revision = std::nullopt)
      : client_(client), at_revision_(at_revision) {}

  const MapProfile& profile() const override { return client_.profile(); }
  // Errors as of AtlasClient::QueryRegion.
  Status ReadLevel(std::uint8_t level,
                   const std::optional<DiscArea>& disc,
                   const OnTile& on_tile) override;

 private:
  AtlasClient& client_;
  std::optional<std::uint64_t> at_revision_;
};

}  // namespace atlas
