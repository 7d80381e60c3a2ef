// Routes between random places of an atlas file: with a corridor, from tiles in memory and from the
// file, and over everything on the finest level. A JSON line a pair.
// Usage: planning_bench ATLAS.db PAIRS SEED    until so many pairs have a route
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>
#include <unordered_map>
#include <vector>

#include "client/atlas_file/atlas_file.h"
#include "client/map/arena.h"
#include "client/score/cpu_timer.h"
#include "core/planning/plan_route.h"
#include "core/tile/tile_codec.h"

namespace atlas::testing {
namespace {

// More than any search here takes: exhaustive ones are to come to their end.
constexpr std::size_t kMemory_bytes = std::size_t{16} << 30;
constexpr std::uint64_t kExpansions = 1'000'000'000;

// All tiles of an atlas, decoded.
class DecodedTiles : public TileSource {
 public:
  static Result<DecodedTiles> Read(AtlasFile& file) {
    DecodedTiles tiles;
    for (std::uint8_t level = 0; level < file.profile().levels; ++level) {
      const Status status = file.ReadLevel(level, std::nullopt, [&](const TileBlob& read) {
        auto tile = DecodeTile(read.blob, file.profile());
        if (!tile) return tile.error();
        if (level == 0) tiles.finest_.push_back(read.id);
        tiles.tiles_.emplace(read.id.Key(), *std::move(tile));
        return Status();
      });
      if (!status.ok()) return Error(status);
    }
    return tiles;
  }

  Result<const Tile*> Get(const TileId& id) override {
    const auto found = tiles_.find(id.Key());
    return found == tiles_.end() ? nullptr : &found->second;
  }
  const std::vector<TileId>& finest() const { return finest_; }

 private:
  std::unordered_map<std::uint64_t, Tile> tiles_;
  std::vector<TileId> finest_;
};

// Read and decoded when asked for.
class EncodedTiles : public TileSource {
 public:
  explicit EncodedTiles(AtlasFile& file) : file_(file) {}

  Result<const Tile*> Get(const TileId& id) override {
    const auto read = file_.Read(id);
    if (!read) return Error(read.error());
    if (!read->has_value()) return nullptr;
    auto tile = DecodeTile((*read)->blob, file_.profile());
    if (!tile) return Error(tile.error());
    tile_ = *std::move(tile);
    return &tile_;
  }

 private:
  AtlasFile& file_;
  Tile tile_;
};

// Any traversable layer of any cell of any tile.
class Places {
 public:
  Places(DecodedTiles& tiles, const MapProfile& profile, std::uint32_t seed)
      : tiles_(tiles), profile_(profile), random_(seed) {}

  Eigen::Vector3d Next() {
    while (true) {
      const TileId id = tiles_.finest()[random_() % tiles_.finest().size()];
      const std::uint32_t side = profile_.tile_cells;
      const std::uint32_t cell = random_() % (side * side);
      const auto layers = tiles_.Get(id).value()->Layers(cell);
      if (layers.empty()) continue;
      const TileLayer& layer = layers[random_() % layers.size()];
      if (!layer.is_traversable()) continue;
      const auto middle_m = [&](std::int64_t tile, std::uint32_t in_tile) {
        return (static_cast<double>(tile * side + in_tile) + 0.5) * profile_.cell_size_m();
      };
      return {middle_m(id.x, cell % side), middle_m(id.y, cell / side), 1e-3 * layer.altitude_mm};
    }
  }

 private:
  DecodedTiles& tiles_;
  const MapProfile& profile_;
  std::mt19937 random_;
};

struct Run {
  Status failure;  // nothing to stand on
  Route route;
  double ms = 0.0;
};

Run Plan(TileSource& tiles, const MapProfile& profile, PlanRequest request) {
  Run run;
  const CpuTimer timer;
  Arena memory;
  request.memory = &memory;
  auto route = PlanRoute(tiles, profile, request);
  run.ms = 1e3 * timer.elapsed_s();
  if (route) {
    run.route = *std::move(route);
  } else {
    run.failure = route.error();
  }
  return run;
}

void PrintPoint(const char* name, const Eigen::Vector3d& p) {
  std::cout << '"' << name << "\": [" << p.x() << ", " << p.y() << ", " << p.z() << "], ";
}

void PrintRun(const char* name, const Run& run) {
  std::cout << '"' << name << "\": {\"found\": " << (run.route.found ? "true" : "false")
            << ", \"error\": \"" << (run.failure.ok() ? "" : StatusCodeName(run.failure.code()))
            << "\", \"ms\": " << run.ms << ", \"cost\": " << run.route.cost
            << ", \"searched_cost\": " << run.route.searched_cost
            << ", \"length_m\": " << run.route.length_m
            << ", \"expansions\": " << run.route.expansions
            << ", \"tiles\": " << run.route.tiles_loaded
            << ", \"memory_bytes\": " << run.route.max_memory_bytes << "}";
}

Status Compare(const std::string& path, int pairs, std::uint32_t seed) {
  auto file = AtlasFile::Open(path);
  if (!file) return file.error();
  auto decoded = DecodedTiles::Read(*file);
  if (!decoded) return decoded.error();
  Places places(*decoded, file->profile(), seed);
  for (int found = 0; found < pairs;) {
    PlanRequest request{places.Next(), places.Next(), {}, {}};
    const Run warm = Plan(*decoded, file->profile(), request);
    EncodedTiles encoded(*file);
    const Run cold = Plan(encoded, file->profile(), request);
    request.options.max_memory_bytes = kMemory_bytes;
    request.options.max_expansions = kExpansions;
    request.options.is_exhaustive = true;
    const Run all = Plan(*decoded, file->profile(), request);
    std::cout << "{";
    PrintPoint("from", request.from);
    PrintPoint("to", request.to);
    PrintRun("warm", warm);
    std::cout << ", ";
    PrintRun("cold", cold);
    std::cout << ", ";
    PrintRun("all", all);
    std::cout << ", \"map_tiles\": " << decoded->finest().size() << "}" << std::endl;
    found += all.route.found ? 1 : 0;
  }
  return {};
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: planning_bench ATLAS.db PAIRS SEED\n";
    return 2;
  }
  const atlas::Status status = atlas::testing::Compare(
      argv[1], std::atoi(argv[2]), static_cast<std::uint32_t>(std::atoi(argv[3])));
  if (!status.ok()) {
    std::cerr << "planning_bench: " << status.message() << "\n";
    return 1;
  }
  return 0;
}
