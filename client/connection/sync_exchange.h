// One sync as messages: the request that a query makes, and its replies, believed only where they
// agree with what was asked and announced. No I/O. Internal to the client library: this header has
// Protobuf in it and is included by sources only.
#pragma once

#include <cstdint>
#include <vector>

#include "client/connection/requests.h"
#include "client/connection/sync_query.h"
#include "core/base/status.h"
#include "proto/wire/envelope.h"

namespace atlas {

// kInvalidArgument: an area that no daemon accepts or no message holds.
Result<wire::Envelope> SyncRequestOf(const SyncQuery& query);

// The replies in their order. Each failure is kInvalidData and says what the daemon did wrong.
class SyncExchange {
 public:
  // The query outlives the exchange.
  explicit SyncExchange(const SyncQuery& query);

  Status OnManifest(const wire::SyncManifest& manifest, std::uint64_t frame_bytes);
  Result<TileBlob> OnTile(const wire::TileMessage& tile, std::uint64_t frame_bytes);
  Result<SyncSummary> OnEnd(const wire::SyncEnd& end, std::uint64_t frame_bytes);
  // What came, before the end.
  SyncSummary so_far() const;

 private:
  struct Announced {
    std::uint64_t key = 0;
    std::uint64_t revision = 0;
    std::uint64_t payload_hash = 0;
    std::uint32_t bytes = 0;
  };

  Status Announce(const wire::SyncManifest& manifest);
  Status TakeHoldings(const wire::SyncManifest& manifest);
  Status CheckAllCame() const;
  bool IsHeld(const wire::TileMessage& tile) const;  // its base, told by itself
  Status Count(std::uint64_t frame_bytes);

  const SyncQuery& query_;
  SyncSummary summary_;
  std::vector<Announced> announced_;  // by the last manifest
  std::size_t came_ = 0;              // of these
  bool has_begun_ = false;
};

}  // namespace atlas
