#include "client/merge/plan/merge_effect.h"

#include <cstddef>
#include <map>

#include "core/base/str_cat.h"
#include "core/fusion/observation/keyframe_placement.h"

namespace atlas {
namespace {

Status AddFootprint(const QuantizedPose& T_world_sensor,
                    const KeyframeHeader& header,
                    const MapProfile& profile,
                    std::set<TileId>& tiles) {
  const auto placement = PlaceKeyframe(T_world_sensor, header.level_quaternion);
  if (!placement) return placement.error();
  const std::vector<TileId> touched = FootprintTiles(*placement, header.grid, profile);
  tiles.insert(touched.begin(), touched.end());
  return {};
}

}  // namespace

Status AddTouchedTiles(const MergeSession& session,
                       const std::vector<MovedKeyframe>& moved,
                       bool is_published,
                       const HeaderReader& read,
                       const MapProfile& profile,
                       std::set<TileId>& tiles) {
  std::map<std::size_t, QuantizedPose> moves;
  for (const MovedKeyframe& one : moved) {
    moves.emplace(one.keyframe, one.T_world_sensor);
  }
  std::set<TileId> touched;
  for (std::size_t i = 0; i < session.keyframes.size(); ++i) {
    const auto move = moves.find(i);
    if (move == moves.end() && !is_published) continue;
    const auto header = read(i);
    if (!header) return header.error();
    Status status;
    // A staged session's keyframes were nowhere before.
    if (move == moves.end() || !is_published) {
      status = AddFootprint(session.keyframes[i].T_world_sensor, *header, profile, touched);
    }
    if (status.ok() && move != moves.end()) {
      status = AddFootprint(move->second, *header, profile, touched);
    }
    if (!status.ok()) {
      return status.WithContext(StrCat("keyframe ", session.keyframes[i].sequence));
    }
  }
  tiles.insert(touched.begin(), touched.end());
  return {};
}

}  // namespace atlas
