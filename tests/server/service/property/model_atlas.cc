#include "tests/server/service/property/model_atlas.h"

#include <cmath>
#include <cstdlib>
#include <utility>

#include <openssl/evp.h>

#include "core/base/str_cat.h"
#include "core/fusion/observation/keyframe_placement.h"
#include "core/geometry/plausibility.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_pyramid.h"
#include "tests/core/fusion/oracle/plain_fusion.h"

namespace atlas::testing {

Result<PutKeyframeResult> ModelAtlas::Put(const Placing& placing) {
  const bool is_staged = script_.frames[placing.frame].is_staged;
  const Session begun{is_staged ? SessionState::kStaged : SessionState::kLive, false, !is_staged};
  Session& session = sessions_.try_emplace(SessionOf(placing.frame), begun).first->second;
  if (session.state == SessionState::kPurged) {
    return Error(StatusCode::kConflict, "purged");
  }
  const auto found = frames_.find(placing.frame);
  if (found != frames_.end()) {
    return found->second.content == placing.content ? Result<PutKeyframeResult>({true, 0, 0})
                                                    : Error(StatusCode::kConflict, "other content");
  }
  frames_[placing.frame] = {placing.content, placing.pose, false, placing.pose};
  PutKeyframeResult result;
  const bool is_judged =
      session.state == SessionState::kLive || session.state == SessionState::kQuarantined;
  const SessionState now = is_judged ? Judge(SessionOf(placing.frame)) : session.state;
  if (std::exchange(session.state, now) != now) {
    result.judgement = SessionJudgement{now, ""};
    result.tiles_marked = Touch(TilesOf(SessionOf(placing.frame)));
  } else if (IsLive(placing.frame)) {
    const std::vector<TileId> footprint = Footprint(placing.frame);
    result.tiles_marked = Touch({footprint.begin(), footprint.end()});
  }
  return result;
}

Result<PoseBatchResult> ModelAtlas::Move(const std::vector<Placing>& placings) {
  std::set<std::size_t> moved;
  bool is_twice = false;
  for (const Placing& placing : placings) {
    if (!frames_.contains(placing.frame)) {
      return Error(StatusCode::kNotFound, "no such keyframe");
    }
    is_twice = !moved.insert(placing.frame).second || is_twice;
  }
  if (is_twice) {
    return Error(StatusCode::kInvalidData, "twice in the batch");
  }
  PoseBatchResult result;
  std::set<TileId> tiles;
  const auto add_footprint = [&](std::size_t frame) {
    if (IsLive(frame)) {
      const std::vector<TileId> footprint = Footprint(frame);
      tiles.insert(footprint.begin(), footprint.end());
    }
  };
  for (const Placing& placing : placings) {
    Frame& frame = frames_.at(placing.frame);
    if (!frame.is_dropped && frame.pose != placing.pose) {
      ++result.updated;
      add_footprint(placing.frame);
      frame.pose = placing.pose;
      add_footprint(placing.frame);
    }
  }
  result.tiles_marked = Touch(tiles);
  return result;
}

// By all ways in sequence; none leads over a keyframe that was dropped.
SessionState ModelAtlas::Judge(const SessionKey& key) const {
  std::map<std::uint32_t, std::optional<UploadedPlace>> places;
  for (const auto& [index, frame] : frames_) {
    const ScriptFrame& script = script_.frames[index];
    if (script.key.session != key) {
      continue;
    }
    const QuantizedPose& pose = frame.uploaded_pose;
    std::optional<UploadedPlace>& place = places[script.key.sequence];
    if (!frame.is_dropped) {
      place = {script.key.sequence, script.contents[frame.content].time_ms, pose.x_um, pose.y_um,
               pose.z_um};
    }
  }
  UploadedTrack track(script_.plausibility);
  for (const auto& [sequence, place] : places) {
    if (!place) {
      track.Break();
    } else if (track.Add(*place)) {
      return SessionState::kQuarantined;
    }
  }
  return SessionState::kLive;
}

std::set<TileId> ModelAtlas::TilesOf(const SessionKey& key) const {
  std::set<TileId> tiles;
  for (const auto& [index, frame] : frames_) {
    if (SessionOf(index) == key && !frame.is_dropped) {
      const std::vector<TileId> footprint = Footprint(index);
      tiles.insert(footprint.begin(), footprint.end());
    }
  }
  return tiles;
}

void ModelAtlas::TouchSessionsOf(const std::vector<Placing>& placings) {
  for (const Placing& placing : placings) {
    Touch(TilesOf(SessionOf(placing.frame)));
  }
}

SessionState ModelAtlas::StateAfter(const SessionKey& key, SessionAction action) const {
  const Session& session = sessions_.at(key);
  switch (action) {
    case SessionAction::kRetract:
      return SessionState::kRetracted;
    case SessionAction::kRestore:
      if (session.state != SessionState::kRetracted) {
        return session.state;
      }
      if (!session.is_published) {
        return SessionState::kStaged;
      }
      return session.is_released ? SessionState::kReleased : Judge(key);
    case SessionAction::kPublish:
      return session.state == SessionState::kStaged ? Judge(key) : session.state;
    case SessionAction::kRelease:
      return SessionState::kReleased;
    case SessionAction::kPurge:
      break;
  }
  return SessionState::kPurged;
}

// How many keyframes there were.
std::uint64_t ModelAtlas::Forget(const SessionKey& key) {
  std::uint64_t stored = 0;
  for (auto next = frames_.begin(); next != frames_.end();) {
    const auto one = next++;
    if (SessionOf(one->first) == key) {
      stored += one->second.is_dropped ? 0u : 1u;
      frames_.erase(one);
    }
  }
  return stored;
}

Result<SessionChangeResult> ModelAtlas::Change(const SessionKey& key, SessionAction action) {
  const auto found = sessions_.find(key);
  if (found == sessions_.end()) {
    return Error(StatusCode::kNotFound, "no such session");
  }
  Session& session = found->second;
  const bool is_purged = session.state == SessionState::kPurged;
  const bool is_release = action == SessionAction::kRelease;
  const bool is_publish = action == SessionAction::kPublish;
  if ((is_purged && action != SessionAction::kPurge) ||
      (session.state == SessionState::kRetracted && (is_release || is_publish)) ||
      (session.state == SessionState::kStaged && is_release)) {
    return Error(StatusCode::kConflict, "not in this state");
  }
  SessionChangeResult result;
  result.state = StateAfter(key, action);
  const bool was_in_map = IsInMap(session.state);
  result.is_changed = std::exchange(session.state, result.state) != result.state;
  session.is_released = session.is_released || is_release;
  session.is_published = session.is_published || is_publish;
  if (was_in_map != IsInMap(result.state)) {
    result.tiles_marked = Touch(TilesOf(key));
  }
  if (result.is_changed && action == SessionAction::kPurge) {
    result.keyframes = Forget(key);
  }
  return result;
}

std::string ModelAtlas::Keep(const std::set<KeyframeKey>& remaining, std::int64_t before_ms) {
  for (auto& [index, frame] : frames_) {
    const ScriptFrame& script = script_.frames[index];
    if (frame.is_dropped || remaining.contains(script.key)) {
      continue;
    }
    if (!IsLive(index) || script.contents[frame.content].time_ms >= before_ms) {
      return StrCat("keyframe ", script.key, " was dropped");
    }
    frame.is_dropped = true;
  }
  return "";
}

PlacedKeyframe ModelAtlas::Placed(std::size_t index, const Frame& frame) const {
  const ScriptFrame& script = script_.frames[index];
  const FrameContent& content = script.contents[frame.content];
  return {script.key, content.time_ms,
          PlaceKeyframe(frame.pose, content.keyframe->level_quaternion).value(), content.keyframe};
}

std::vector<TileId> ModelAtlas::Footprint(std::size_t index) const {
  const PlacedKeyframe placed = Placed(index, frames_.at(index));
  return FootprintTiles(placed.placement, placed.keyframe->grid, script_.profile);
}

// How many there are at level 0.
std::uint32_t ModelAtlas::Touch(const std::set<TileId>& tiles) {
  for (TileId id : tiles) {
    touched_.insert(id.Key());
    while (id.level + 1 < script_.profile.levels) {
      id = id.Parent();
      touched_.insert(id.Key());
    }
  }
  return static_cast<std::uint32_t>(tiles.size());
}

std::set<std::uint64_t> ModelAtlas::TakeTouched() {
  return std::exchange(touched_, {});
}

// Asks for every tile near a keyframe, not only for those of its footprint.
std::map<TileId, Tile> ModelAtlas::FuseLevel0() const {
  std::map<TileId, std::vector<PlacedKeyframe>> near;
  for (const auto& [index, frame] : frames_) {
    if (!IsLive(index)) {
      continue;
    }
    const PlacedKeyframe placed = Placed(index, frame);
    const double side_m = script_.profile.tile_size_m();
    const double reach_m = script_.profile.cell_size_m() * (placed.keyframe->grid.radius_cells + 2);
    const auto tile_at = [side_m](std::int64_t position_um, double offset_m) {
      return static_cast<std::int32_t>(
          std::floor((1e-6 * static_cast<double>(position_um) + offset_m) / side_m));
    };
    const std::int32_t last_y = tile_at(placed.placement.y_um, reach_m);
    const std::int32_t last_x = tile_at(placed.placement.x_um, reach_m);
    for (std::int32_t y = tile_at(placed.placement.y_um, -reach_m); y <= last_y; ++y) {
      for (std::int32_t x = tile_at(placed.placement.x_um, -reach_m); x <= last_x; ++x) {
        near[TileId{0, x, y}].push_back(placed);
      }
    }
  }
  std::map<TileId, Tile> tiles;
  for (const auto& [id, keyframes] : near) {
    Tile tile = PlainFuseTile(id, keyframes, script_.profile);
    if (!tile.is_empty()) {
      tiles.emplace(id, std::move(tile));
    }
  }
  return tiles;
}

std::map<TileId, Tile> ModelAtlas::BuildParents(const std::map<TileId, Tile>& children) const {
  std::map<TileId, Tile> parents;
  for (const auto& [child, tile] : children) {
    const TileId id = child.Parent();
    if (parents.contains(id)) {
      continue;
    }
    std::array<const Tile*, 4> four{};
    for (std::size_t i = 0; i < four.size(); ++i) {
      const auto found = children.find(id.Children()[i]);
      four[i] = found == children.end() ? nullptr : &found->second;
    }
    parents.emplace(id, BuildParentTile(id, four, script_.profile));
  }
  return parents;
}

ModelAtlas::Payloads ModelAtlas::Tiles() const {
  Payloads payloads;
  std::map<TileId, Tile> level = FuseLevel0();
  for (int l = 0; l < script_.profile.levels; ++l) {
    for (const auto& [id, tile] : level) {
      payloads.emplace(id.Key(), EncodeTilePayload(tile, script_.profile));
    }
    level = BuildParents(level);
  }
  return payloads;
}

std::array<std::uint8_t, 32> DigestOf(const ModelAtlas::Payloads& tiles) {
  Bytes all;
  const auto add_number = [&all](std::uint64_t value) {
    for (int shift = 56; shift >= 0; shift -= 8) {
      all.push_back(static_cast<std::uint8_t>(value >> shift));
    }
  };
  for (const auto& [key, payload] : tiles) {
    add_number(key);
    add_number(payload.size());
    all.insert(all.end(), payload.begin(), payload.end());
  }
  std::array<std::uint8_t, 32> sha256{};
  if (EVP_Digest(all.data(), all.size(), sha256.data(), nullptr, EVP_sha256(), nullptr) != 1) {
    std::abort();
  }
  return sha256;
}

}  // namespace atlas::testing
