// Tiles on a vehicle's disk: one folder an atlas, one file a tile (docs/formats/vehicle.md). What a
// file holds is in its name, too, so that a folder is opened without reading any; what is read is
// believed only when its checksum, its atlas and its name agree.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "client/connection/sync_query.h"
#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"

namespace atlas {

struct AtlasKey {
  Bytes atlas_id;  // 16 bytes
  MapProfile profile;

  friend bool operator==(const AtlasKey&, const AtlasKey&) = default;
};

struct TileFacts {
  TileId id;
  std::uint64_t revision = 0;
  std::uint64_t payload_hash = 0;
  SectionBits sections = kEverySection;  // asked for, whether the tile has them or not
};

class TileFiles {
 public:
  struct Found {
    TileFacts facts;
    std::uint64_t bytes = 0;
  };

  // The atlases with a folder below `root`, the one that was opened last first: where a vehicle
  // without a connection begins.
  static std::vector<AtlasKey> Known(const std::filesystem::path& root);

  // Makes the folder if there is none, and is the last one opened then, as far as the disk lets it
  // be written down. A folder of another profile is emptied.
  static Result<TileFiles> Open(const std::filesystem::path& root, const AtlasKey& atlas);

  // By when they were written, the last one last. Removes what writes that never ended left, and
  // the older of two of a tile.
  std::vector<Found> List();
  // The bytes that the file takes.
  Result<std::uint64_t> Write(const TileFacts& facts, ByteSpan blob);
  // kInvalidData: damaged, or of another tile or atlas than its name says.
  Result<Bytes> Read(const TileFacts& facts) const;
  void Remove(const TileFacts& facts);

 private:
  TileFiles(std::filesystem::path folder, Bytes atlas_id);
  std::filesystem::path PathOf(const TileFacts& facts) const;
  void RemoveAll();

  std::filesystem::path folder_;
  Bytes atlas_id_;
};

}  // namespace atlas
