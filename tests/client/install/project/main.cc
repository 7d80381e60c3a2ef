// A vehicle that nobody answers: it opens its store and asks for the map around it.
#include <iostream>

#include "client/vehicle/atlas_view.h"

int main(int argc, char** argv) {
  const atlas::AtlasKey key{atlas::Bytes(16, 1), atlas::MapProfile()};
  atlas::TileStoreOptions options;
  options.folder = argc > 1 ? argv[1] : "tiles";
  auto store = atlas::TileStore::Open(key, options);
  if (!store) {
    std::cerr << store.error().message() << '\n';
    return 1;
  }
  atlas::LinkOptions link_options;
  link_options.connection.endpoint.port = 1;
  atlas::AtlasLink link(link_options);
  atlas::AtlasView view(*store, &link);
  const auto map = view.Around({0.0, 0.0}, 50.0);
  if (!map) {
    std::cerr << map.error().message() << '\n';
    return 1;
  }
  std::cout << map->tiles.size() << " tiles, " << map->sync.message() << '\n';
  const bool is_expected =
      map->tiles.empty() && !map->is_current && map->sync.code() == atlas::StatusCode::kUnavailable;
  return is_expected ? 0 : 1;
}
