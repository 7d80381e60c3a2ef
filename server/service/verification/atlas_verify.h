// Reads everything back: every checksum, every blob, and if asked every tile against one rebuilt
// from the keyframes. Damaged keyframes are listed, damaged tiles marked; with `repair` damage is
// put right where something tells how, and given up where nothing does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/service/fusion/tile_builder.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct VerifyReport {
  std::uint64_t checked = 0;  // keyframes and tiles
  std::uint64_t damaged = 0;
  std::uint64_t mismatched = 0;       // stored tile is not what its keyframes make
  std::vector<std::string> findings;  // the first few
  std::uint64_t revision = 0;
  // With `repair`: what was found and put right, and keyframes that are gone. What is damaged or
  // mismatched then is what still is.
  std::uint64_t restored = 0;
  std::uint64_t given_up = 0;
  std::uint64_t marks = 0;  // on tiles: as many revisions that are its own
};

struct VerifyRequest {
  bool rebuild = false;
  bool repair = false;
  std::string author = {};  // of repairs
};

class AtlasVerifier {
 public:
  struct Options {
    VerifyRequest request;
    std::size_t keyframe_bytes = std::size_t{128} << 20;  // decoded
    std::size_t tile_bytes = std::size_t{128} << 20;      // of the tile that is rebuilt
    std::size_t max_findings = 20;
    // Asked between tiles, and before each keyframe of one that is rebuilt; a failed status ends
    // the verification with it.
    std::function<Status()> check_stop;
    // Told the size of each blob that was checked, if given.
    std::function<void(std::size_t)> on_read = {};
  };

  AtlasVerifier(AtlasStore& store, Options options);

  Result<VerifyReport> Run();

 private:
  Status RepairTables(TableRepair what);
  Status VerifySessions();
  Status VerifyCompactions();
  Status VerifyCounters();
  Status VerifyKeyframes();
  Status VerifyTiles();
  Status VerifyMissingTiles();
  Result<bool> IsListed(std::int64_t id);
  Status CheckKeyframe(std::int64_t id);
  Status HandleKeyframe(std::int64_t id, const Status& damage);
  Status HandleTile(const TileId& id);
  Status HandlePlaceOf(const TileId& id);
  Result<RepairOutcome> RepairOnce(std::int64_t id);
  Status CheckTile(const TileId& id);
  Status CompareTile(const TileId& id, const std::optional<StoredTile>& stored);
  Status CheckParentExists(const TileId& id);
  Status Note(Status problem);
  Status Unnoted(const Status& refusal);
  Status Mismatch(const TileId& id, const std::string& what);

  AtlasStore& store_;
  Options options_;
  bool looks_for_missing_;  // tiles: on demand, and where rows vanished
  KeyframeCache keyframes_;
  TileCache tiles_{0};  // what is verified is read
  TileBuilder builder_;
  VerifyReport report_;
  std::string unnoted_;  // why what is found cannot be written down; empty: it can
};

}  // namespace atlas
