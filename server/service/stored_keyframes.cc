#include "server/service/stored_keyframes.h"

#include "core/base/str_cat.h"
#include "core/fusion/keyframe_placement.h"
#include "core/keyframe/keyframe_codec.h"

namespace atlas {

Result<std::vector<FrameOnMap>> PlaceKeyframes(const std::vector<KeyframeRecord>& records) {
  std::vector<FrameOnMap> frames;
  frames.reserve(records.size());
  for (const KeyframeRecord& record : records) {
    const auto placement = PlaceKeyframe(record.pose, record.level_quaternion);
    if (!placement) {
      return Error(placement.error().WithContext(StrCat("keyframe ", record.key)));
    }
    frames.push_back({record.key, record.time_ms, *placement, record.grid,
                      static_cast<std::uint64_t>(record.id)});
  }
  return frames;
}

Result<KeyframeCache::Handle> ReadKeyframe(const FrameOnMap& frame,
                                           AtlasStore& store,
                                           KeyframeCache& cache) {
  const auto load = [&store](std::int64_t id) -> Result<Keyframe> {
    const auto blob = store.ReadKeyframeBlob(id);
    return blob ? DecodeKeyframe(*blob) : Error(blob.error());
  };
  auto keyframe = cache.Get(static_cast<std::int64_t>(frame.content), load);
  if (!keyframe) {
    return Error(keyframe.error().WithContext(StrCat("keyframe ", frame.key)));
  }
  if ((*keyframe)->grid != frame.grid) {
    return Error(StatusCode::kInvalidData,
                 StrCat("keyframe ", frame.key, ": its grid is not the one of its row"));
  }
  return keyframe;
}

}  // namespace atlas
