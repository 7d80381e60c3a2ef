#include "tests/bench/serving/tile_files.h"

#include <cstdio>
#include <fstream>
#include <string>

#include <sys/stat.h>

#include "core/base/str_cat.h"
#include "tests/bench/serving/load_case.h"

namespace atlas::testing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kList = "tiles.txt";  // a line a tile: key, hash of its content

// As nginx makes it.
std::string EtagOf(const fs::path& file) {
  struct stat info {};
  if (::stat(file.c_str(), &info) != 0) {
    return {};
  }
  char text[64];
  std::snprintf(text, sizeof(text), "\"%lx-%lx\"", static_cast<unsigned long>(info.st_mtime),
                static_cast<unsigned long>(info.st_size));
  return text;
}

}  // namespace

Status WriteTileFiles(const ConnectionOptions& daemon, const fs::path& directory) {
  auto client = AtlasClient::Connect(daemon);
  if (!client) {
    return client.error();
  }
  fs::create_directories(directory);
  std::ofstream list(directory / kList);
  const auto summary = client->QueryRegion({}, [&](const TileBlob& tile) {
    std::ofstream file(directory / StrCat(tile.id.Key()), std::ios::binary);
    file.write(reinterpret_cast<const char*>(tile.blob.data()),
               static_cast<std::streamsize>(tile.blob.size()));
    list << tile.id.Key() << ' ' << tile.payload_hash << '\n';
    return file ? Status() : Status(StatusCode::kResourceExhausted, "cannot write the files");
  });
  return summary ? Status() : summary.error();
}

Result<std::vector<LoadTile>> ReadTileList(const fs::path& directory) {
  std::vector<LoadTile> tiles;
  std::ifstream list(directory / kList);
  LoadTile tile;
  while (list >> tile.key >> tile.payload_hash) {
    tile.path = StrCat(tile.key);
    tile.etag = EtagOf(directory / tile.path);
    tiles.push_back(tile);
  }
  if (tiles.size() < kTilesPerBatch) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat(directory.string(), ": ", tiles.size(), " tiles, expected at least ",
                        kTilesPerBatch));
  }
  return tiles;
}

}  // namespace atlas::testing
