// What the daemon does, one function a use case: checks what came in, asks the store, never sees the
// wire. May be called from any thread. Functions that return a Result may block on the disk; run them
// on a worker thread. `Done` callbacks come on the store's thread and must not block.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct UploadRequest {
  KeyframeKey key;
  std::int64_t time_ms = 0;
  QuantizedPose pose;
  std::optional<PositionPrior> prior;
  Bytes blob;
};

struct PoseUpdate {
  KeyframeKey key;
  QuantizedPose pose;
};

struct PoseUpdateRequest {
  std::vector<PoseUpdate> updates;
  std::string author;
  std::uint64_t if_revision = 0;
};

struct RegionRequest {
  struct Disc {
    std::int64_t x_um = 0;
    std::int64_t y_um = 0;
    std::uint64_t radius_um = 0;
  };
  std::optional<Disc> disc;  // none: the whole atlas
  std::uint8_t finest_level = 0;
  std::optional<std::uint8_t> coarsest_level;  // none: the profile's coarsest
  bool is_only_finest = false;
};

struct ServiceStatus {
  StoreCounts counts;
  std::uint64_t rss_bytes = 0;
};

struct DigestResult {
  std::array<std::uint8_t, 32> sha256{};
  std::uint64_t tiles = 0;
  std::uint64_t revision = 0;
};

struct VerifyResult {
  std::uint64_t checked = 0;
  std::uint64_t damaged = 0;
  std::uint64_t mismatched = 0;
  std::vector<std::string> findings;  // the first few
  std::uint64_t revision = 0;
};

class AtlasService {
 public:
  template <typename T>
  using Done = AtlasStore::Done<T>;
  using Clock = std::function<std::int64_t()>;  // milliseconds since 1970

  // `on_dirty` is called after each commit that marked tiles: it wakes the fusion workers.
  AtlasService(AtlasStore& store, Clock now_ms, std::function<void()> on_dirty);

  const AtlasIdentity& identity() const;

  // Errors: kInvalidArgument (names), kInvalidData (blob, profile, pose, tilt above 2 degrees:
  // "upload again", time not in 0 .. now + 60 s), kConflict, and the store's.
  void Upload(UploadRequest request, Done<PutKeyframeResult> done);
  void UpdatePoses(PoseUpdateRequest request, Done<PoseBatchResult> done);

  // The tiles of a region in the order in which they are worth sending: coarse levels first, within a
  // level the nearest to the disc's centre first. kResourceExhausted above 1 million tiles.
  Result<std::vector<TileSummary>> PlanRegion(const RegionRequest& request);
  // In the order of `ids`; nullopt where a tile is gone since.
  Result<std::vector<std::optional<StoredTile>>> ReadTiles(const std::vector<TileId>& ids);

  Result<DirtyState> ReadDirtyState();
  Result<ServiceStatus> ReadStatus();
  Result<std::vector<SessionRecord>> ListSessions();
  // Of what is there now: the caller waits until nothing is dirty, and kConflict asks it to wait again
  // when something became dirty meanwhile.
  Result<DigestResult> Digest();
  Result<VerifyResult> Verify(bool is_rebuild);

 private:
  AtlasStore& store_;
  Clock now_ms_;
  std::function<void()> on_dirty_;
};

}  // namespace atlas
