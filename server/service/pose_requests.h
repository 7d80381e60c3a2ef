// Batches of corrections as they are asked for, and made ready for the store: each keyframe with
// the tiles that it touches at its new pose.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct PoseBatchRequest {
  struct Update {
    KeyframeKey key;
    QuantizedPose pose;
  };
  std::vector<Update> updates;
  std::string author;
  // 0, or the revision that it was computed at: kConflict if its sessions changed since.
  std::uint64_t if_revision = 0;
  std::vector<SessionKey> published = {};  // staged sessions that come into the map by it
};

struct PoseUndoRequest {
  std::uint64_t batch = 0;
  std::string author;
};

// Looks at its condition, too, so that what changed since is no unknown keyframe; the store does so
// again when the batch is written. kInvalidArgument on names, or too many sessions; kInvalidData
// names a keyframe whose pose is not one or is tilted against its levelling; else errors as of
// AtlasStore::CheckUnchanged and FindKeyframes.
Result<PoseBatch> PlacePoses(AtlasStore& store, PoseBatchRequest request);
// Errors as of AtlasStore::ReadBatchToUndo.
Result<PoseUndo> PlaceUndo(AtlasStore& store, PoseUndoRequest request);

}  // namespace atlas
