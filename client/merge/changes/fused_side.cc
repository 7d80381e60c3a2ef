#include "client/merge/changes/fused_side.h"

#include <utility>

#include "core/base/str_cat.h"
#include "core/fusion/tile_fusion.h"
#include "core/keyframe/keyframe_codec.h"

namespace atlas {
namespace {

constexpr std::size_t kKeptKeyframes = 96;
constexpr std::size_t kKeptTiles = 128;

template <typename T>
void Keep(std::uint64_t key, T value, std::size_t most, LruList<T>& list) {
  list.Insert(key, std::move(value), 1);
  static_cast<void>(list.TakeOldestAbove(most));
}

}  // namespace

FusedSide::FusedSide(const MapProfile& profile) : profile_(profile) {}

Status FusedSide::Add(const MergeSession& session,
                      const std::vector<Pose>& T_world_sensor,
                      const BlobReader& read,
                      const std::function<bool(const Eigen::Vector3d&)>& is_near) {
  for (std::size_t i = 0; i < session.keyframes.size(); ++i) {
    if (!is_near(T_world_sensor[i].translation())) continue;
    const auto blob = read(i);
    if (!blob) return blob.error();
    const KeyframeKey key{session.key, session.keyframes[i].sequence};
    const auto header = ReadKeyframeHeader(*blob);
    if (!header) return header.error().WithContext(StrCat("keyframe ", key));
    const auto placement =
        PlaceKeyframe(QuantizedPose::FromPose(T_world_sensor[i]), header->level_quaternion);
    if (!placement) return placement.error().WithContext(StrCat("keyframe ", key));
    for (const TileId& id : FootprintTiles(*placement, header->grid, profile_)) {
      frames_of_[id].push_back(frames_.size());
    }
    frames_.push_back({{key, session.keyframes[i].time_ms, *placement, header->grid,
                        session.keyframes[i].blob_hash},
                       &read,
                       i});
  }
  return {};
}

std::set<TileId> FusedSide::Tiles() const {
  std::set<TileId> tiles;
  for (const auto& [id, frames] : frames_of_) tiles.insert(id);
  return tiles;
}

Result<std::shared_ptr<const Keyframe>> FusedSide::Decode(std::size_t frame) {
  if (auto* const known = keyframes_.Use(frame)) return *known;
  const Frame& one = frames_[frame];
  const auto blob = (*one.read)(one.keyframe);
  if (!blob) return Error(blob.error());
  auto keyframe = DecodeKeyframe(*blob);
  if (!keyframe) return Error(keyframe.error().WithContext(StrCat("keyframe ", one.on_map.key)));
  auto decoded = std::make_shared<const Keyframe>(*std::move(keyframe));
  Keep(frame, decoded, kKeptKeyframes, keyframes_);
  return decoded;
}

Result<std::shared_ptr<const Tile>> FusedSide::Fuse(const TileId& id) {
  const auto touching = frames_of_.find(id);
  if (touching == frames_of_.end()) return nullptr;
  if (auto* const known = tiles_.Use(id.Key())) return *known;
  std::vector<FrameOnMap> frames;
  for (const std::size_t frame : touching->second) {
    frames.push_back(frames_[frame].on_map);
  }
  auto tile = FuseTile(
      id, frames, [&](std::size_t i) { return Decode(touching->second[i]); }, profile_);
  if (!tile) return Error(tile.error());
  auto fused = tile->is_empty() ? nullptr : std::make_shared<const Tile>(*std::move(tile));
  Keep(id.Key(), std::shared_ptr<const Tile>(fused), kKeptTiles, tiles_);
  return fused;
}

}  // namespace atlas
