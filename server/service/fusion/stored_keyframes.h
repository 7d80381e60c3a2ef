// From the store's keyframes to what fusion reads: placed on the map, and decoded when asked for.
#pragma once

#include <vector>

#include "core/base/status.h"
#include "core/fusion/observation/frame_on_map.h"
#include "core/keyframe/keyframe.h"
#include "server/service/fusion/lru_cache.h"
#include "server/store/atlas_store.h"

namespace atlas {

using KeyframeCache = LruCache<Keyframe>;  // decoded, by id

// In the same order; their `content` is the keyframe's id. kInvalidData names a pose that is none.
Result<std::vector<FrameOnMap>> PlaceKeyframes(const std::vector<KeyframeRecord>& records);

// The keyframe of one of these, from the cache or the store. kInvalidData names the damaged one.
Result<KeyframeCache::Handle> ReadKeyframe(const FrameOnMap& frame,
                                           AtlasStore& store,
                                           KeyframeCache& cache);

}  // namespace atlas
