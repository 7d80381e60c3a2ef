// An atlas file, the daemon's database or a copy of it, read without a daemon: one state of the
// atlas for as long as it is open, whatever a daemon writes meanwhile. Never changed. One thread at
// a time. docs/client.md, "Without a daemon".
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/connection/requests.h"
#include "client/map/map_source.h"
#include "client/vehicle/tile_files.h"
#include "core/base/status.h"

namespace atlas {

class StoreSnapshot;

class AtlasFile final : public MapSource {
 public:
  // kNotFound: there is no such file, and none is made. kInvalidArgument: a directory, or no file.
  // kInvalidData: not an atlas, or damaged. kUnsupported: of another schema version.
  // kPermissionDenied: unreadable, or with a log beside it that cannot be read where it lies.
  // kUnavailable: the disk fails, or somebody began to write to a file that nobody had open, then
  // and in every later call; open it again.
  static Result<AtlasFile> Open(const std::filesystem::path& file);

  AtlasFile(const AtlasFile&) = delete;
  AtlasFile& operator=(const AtlasFile&) = delete;
  AtlasFile(AtlasFile&&) noexcept;
  AtlasFile& operator=(AtlasFile&&) noexcept;
  ~AtlasFile() override;

  const MapProfile& profile() const override { return key_.profile; }
  const AtlasKey& key() const { return key_; }
  std::uint64_t revision() const;
  // Tiles that show what they showed before the last changes: the daemon has not fused them again
  // yet.
  std::uint64_t dirty_tiles() const;

  // Whether there is a tile at all, damaged or not.
  Result<bool> HasTiles();
  // In the order of the tiles' keys. kInvalidData names a damaged tile.
  Status ReadLevel(std::uint8_t level,
                   const std::optional<DiscArea>& disc,
                   const OnTile& on_tile) override;
  // nullopt: there is no such tile. kInvalidData: it is damaged; others may be read all the same.
  Result<std::optional<TileBlob>> Read(const TileId& id);
  // One that List told: that it is not there is kInvalidData, too, for the file is one state.
  Result<TileBlob> ReadListed(const TileId& id);
  // Calls back for every tile of `level` that the box touches, in the order of their keys. A
  // failing callback, which may read tiles, ends it with its status.
  Status List(std::uint8_t level,
              const BoxArea& box,
              const std::function<Status(const TileFacts&)>& on_tile);

  // All, or all of a vehicle, by vehicle and session, with the revisions at which they changed
  // last. kInvalidData: their index is damaged; damaged ones say so.
  Result<std::vector<SessionSummary>> ListSessions(const std::string& vehicle = {});
  // A session's keyframes with their blobs, by rising sequence number, behind one (nullopt: from
  // the first one on): calls back once a keyframe, damaged ones too. A failing callback ends it
  // with its status. kNotFound: there is no such session. kInvalidData: its row is damaged.
  Result<SessionReading> ReadKeyframes(const SessionKey& session,
                                       std::optional<std::uint32_t> after_sequence,
                                       const std::function<Status(SessionKeyframe)>& on_keyframe);

 private:
  explicit AtlasFile(std::unique_ptr<StoreSnapshot> snapshot);

  std::unique_ptr<StoreSnapshot> snapshot_;
  AtlasKey key_;
};

}  // namespace atlas
