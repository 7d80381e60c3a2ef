// The atlas as it should be: what was accepted, kept in plain maps, and its tiles fused by the
// oracle from nothing each time they are asked for. Parents are the product's BuildParentTile.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/fusion/tile_fusion.h"
#include "core/geometry/tile_id.h"
#include "core/tile/tile.h"
#include "server/store/store_types.h"
#include "tests/server/service/property/atlas_script.h"

namespace atlas::testing {

class ModelAtlas {
 public:
  // Canonical payloads by key.
  using Payloads = std::map<std::uint64_t, Bytes>;

  explicit ModelAtlas(const AtlasScript& script) : script_(script) {}

  // What the product must answer, revisions aside; errors by their code alone.
  Result<PutKeyframeResult> Put(const Placing& placing);
  Result<PoseBatchResult> Move(const std::vector<Placing>& placings);
  Result<SessionChangeResult> Change(const SessionKey& key, SessionAction action);
  // Keyframes that came in another order may have put their sessions out and in again.
  void TouchSessionsOf(const std::vector<Placing>& placings);
  // Makes the accepted keyframes `remaining` ones; the others were dropped, and may be sent again.
  // Empty, or what should not have been dropped: what was not taken before `before_ms`, or is in no
  // live session.
  std::string Keep(const std::set<KeyframeKey>& remaining, std::int64_t before_ms);

  Payloads Tiles() const;
  // Level-0 tiles that changes could reach since this was asked last, and their ancestors.
  std::set<std::uint64_t> TakeTouched();

 private:
  struct Frame {
    std::size_t content = 0;
    QuantizedPose pose;
    bool is_dropped = false;
    QuantizedPose uploaded_pose = {};
  };
  struct Session {
    SessionState state = SessionState::kLive;
    bool is_released = false;
    bool is_published = false;  // or never was staged
  };

  const SessionKey& SessionOf(std::size_t frame) const { return script_.frames[frame].key.session; }
  bool IsLive(std::size_t frame) const {
    return IsInMap(sessions_.at(SessionOf(frame)).state) && !frames_.at(frame).is_dropped;
  }
  SessionState Judge(const SessionKey& key) const;
  SessionState StateAfter(const SessionKey& key, SessionAction action) const;
  std::set<TileId> TilesOf(const SessionKey& key) const;
  std::uint64_t Forget(const SessionKey& key);
  PlacedKeyframe Placed(std::size_t index, const Frame& frame) const;
  std::vector<TileId> Footprint(std::size_t index) const;
  std::uint32_t Touch(const std::set<TileId>& tiles);
  std::map<TileId, Tile> FuseLevel0() const;
  std::map<TileId, Tile> BuildParents(const std::map<TileId, Tile>& children) const;

  const AtlasScript& script_;
  std::map<std::size_t, Frame> frames_;  // by their number in the script
  std::map<SessionKey, Session> sessions_;
  std::set<std::uint64_t> touched_;
};

// SHA-256 over the tiles, as docs/protocol.md says it (DigestRequest).
std::array<std::uint8_t, 32> DigestOf(const ModelAtlas::Payloads& tiles);

}  // namespace atlas::testing
