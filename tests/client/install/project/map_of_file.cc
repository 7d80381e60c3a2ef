// The map around a pose from an atlas file. Usage: map_of_file FILE X Y
#include <cstdlib>
#include <iostream>

#include "client/atlas_file/file_feed.h"
#include "client/vehicle/atlas_view.h"

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  auto file = atlas::AtlasFile::Open(argv[1]);
  if (!file) {
    std::cerr << atlas::StatusCodeName(file.error().code()) << ": " << file.error().message()
              << '\n';
    return 1;
  }
  auto store = atlas::TileStore::Open(file->key(), {});
  if (!store) return 1;
  atlas::FileFeed feed(*file);
  atlas::AtlasView view(*store, feed);
  const auto map = view.Around({std::atof(argv[2]), std::atof(argv[3])}, 50.0);
  if (!map || !map->sync.ok()) return 1;
  std::cout << map->tiles.size() << " tiles, " << (map->is_current ? "current" : "not current")
            << '\n';
  return 0;
}
