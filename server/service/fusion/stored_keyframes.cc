#include "server/service/fusion/stored_keyframes.h"

#include <memory>
#include <utility>

#include "core/base/str_cat.h"
#include "core/fusion/observation/keyframe_placement.h"
#include "core/keyframe/keyframe_codec.h"

namespace atlas {
namespace {

std::size_t SizeOf(const Keyframe& keyframe) {
  return sizeof(Keyframe) + keyframe.cells.capacity() * sizeof(KeyframeCell) +
         keyframe.columns.capacity() * sizeof(std::uint64_t) +
         keyframe.anchors.capacity() * sizeof(std::int16_t);
}

}  // namespace

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
  KeyframeCache::Handle keyframe = cache.Find(frame.content);
  if (keyframe == nullptr) {
    const auto blob = store.ReadKeyframeBlob(static_cast<std::int64_t>(frame.content));
    auto decoded = blob ? DecodeKeyframe(*blob) : Error(blob.error());
    if (!decoded) {
      return Error(decoded.error().WithContext(StrCat("keyframe ", frame.key)));
    }
    keyframe = std::make_shared<const Keyframe>(*std::move(decoded));
    cache.Insert(frame.content, keyframe, SizeOf(*keyframe));
  }
  if (keyframe->grid != frame.grid) {
    return Error(StatusCode::kInvalidData,
                 StrCat("keyframe ", frame.key, ": its grid is not the one of its row"));
  }
  return keyframe;
}

}  // namespace atlas
