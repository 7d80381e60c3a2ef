// Tiles on a vehicle's disk: one folder an atlas, one file a tile (docs/formats/vehicle.md). What a
// file holds is in its name, too, so that a folder is opened without reading any; what is read is
// believed only when its checksum, its atlas and its name agree.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "client/connection/sync_query.h"
#include "client/vehicle/atlas_folder.h"
#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/tile_id.h"

namespace atlas {

struct TileFacts {
  TileId id;
  std::uint64_t revision = 0;
  std::uint64_t payload_hash = 0;
  SectionBits sections = kEverySection;  // asked for, whether the tile has them or not

  friend bool operator==(const TileFacts&, const TileFacts&) = default;
};

class TileFiles {
 public:
  struct Found {
    TileFacts facts;
    std::uint64_t bytes = 0;
  };

  // As OpenAtlasFolder.
  static Result<TileFiles> Open(const std::filesystem::path& root, const AtlasKey& atlas);

  // By when they were written, the last one last. Removes what writes that never ended left, and
  // the older of two of a tile. Fails where the folder cannot be read to its end.
  Result<std::vector<Found>> List();
  // The bytes that the file takes.
  Result<std::uint64_t> Write(const TileFacts& facts, ByteSpan blob);
  // kInvalidData: damaged, or of another tile or atlas than its name says. kNotFound: the file is
  // gone. Else what the disk said, which is nothing about the tile.
  Result<Bytes> Read(const TileFacts& facts) const;
  void Remove(const TileFacts& facts);
  const std::filesystem::path& folder() const { return folder_; }

 private:
  TileFiles(std::filesystem::path folder, Bytes atlas_id);

  std::filesystem::path PathOf(const TileFacts& facts) const;

  std::filesystem::path folder_;
  Bytes atlas_id_;
};

}  // namespace atlas
