#include "server/service/fusion/stored_keyframes.h"

#include <algorithm>
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

// Where an index lost a keyframe, and it was stored a second time.
Status CheckKeysDiffer(const std::vector<FrameOnMap>& frames) {
  std::vector<const KeyframeKey*> keys;
  keys.reserve(frames.size());
  for (const FrameOnMap& frame : frames) {
    keys.push_back(&frame.key);
  }
  const auto is_less = [](const KeyframeKey* a, const KeyframeKey* b) {
    return *a < *b;
  };
  std::sort(keys.begin(), keys.end(), is_less);
  const auto twin = std::adjacent_find(keys.begin(), keys.end(),
                                       [](const auto* a, const auto* b) { return *a == *b; });
  return twin == keys.end()
             ? Status()
             : Status(StatusCode::kInvalidData,
                      StrCat("keyframe ", **twin, " is stored twice: an index is damaged"));
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
  if (Status status = CheckKeysDiffer(frames); !status.ok()) {
    return Error(std::move(status));
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
