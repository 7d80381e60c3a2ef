// The daemon and a server of static files under the same load: one JSON line a run.
// Usage: serving_bench files SERVER DIRECTORY    writes every tile of an atlas as a file
//        serving_bench run ATLAS_PORT HTTP_PORT DIRECTORY ROUNDS MILLISECONDS
// A round is each case once with each server, in turns.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <sys/stat.h>

#include "client/connection/atlas_client.h"
#include "core/base/str_cat.h"
#include "tests/bench/serving/load_run.h"

namespace atlas::testing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kList = "tiles.txt";  // a line a tile: key, hash of its content

int Fail(const Status& status) {
  std::cerr << status.message() << "\n";
  return 1;
}

Status WriteFiles(const std::string& server, const fs::path& directory) {
  const auto endpoint = Endpoint::Parse(server);
  if (!endpoint) {
    return endpoint.error();
  }
  ConnectionOptions options;
  options.endpoint = *endpoint;
  auto client = AtlasClient::Connect(options);
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

std::vector<LoadTile> ReadTiles(const fs::path& directory) {
  std::vector<LoadTile> tiles;
  std::ifstream list(directory / kList);
  LoadTile tile;
  while (list >> tile.key >> tile.payload_hash) {
    tile.path = StrCat(tile.key);
    tile.etag = EtagOf(directory / tile.path);
    tiles.push_back(tile);
  }
  return tiles;
}

struct Case {
  const char* name;
  LoadMode mode;
  std::size_t tiles_per_batch;
};
constexpr Case kCases[] = {{"single", LoadMode::kFetch, 1},
                           {"pipelined", LoadMode::kFetch, 64},
                           {"not_modified_single", LoadMode::kNotModified, 1},
                           {"not_modified", LoadMode::kNotModified, 64}};

struct Server {
  const char* name;
  LoadProtocol& protocol;
  std::uint16_t port;
};

float QuantileOf(std::vector<float>& values, double q) {
  if (values.empty()) {
    return 0.0F;
  }
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

Status RunOnce(const Server& server,
               const std::vector<LoadTile>& tiles,
               const Case& run,
               int round,
               std::chrono::milliseconds time) {
  LoadOptions options;
  options.port = server.port;
  options.mode = run.mode;
  options.tiles_per_batch = run.tiles_per_batch;
  options.time = time;
  options.seed = static_cast<std::uint64_t>(round) + 1;
  auto result = RunLoad(server.protocol, tiles, options);
  if (!result) {
    return result.error().WithContext(StrCat(server.name, ", ", run.name));
  }
  if ((result->tile_bytes > 0) != (run.mode == LoadMode::kFetch)) {
    return {StatusCode::kInvalidData,
            StrCat(server.name, ", ", run.name, ": sent ", result->tile_bytes, " bytes of tiles")};
  }
  std::cout << "{\"case\": \"" << run.name << "\", \"server\": \"" << server.name
            << "\", \"round\": " << round
            << ", \"tiles_per_s\": " << static_cast<double>(result->tiles) / result->seconds
            << ", \"mib_per_s\": "
            << static_cast<double>(result->wire_bytes) / result->seconds / (1u << 20)
            << ", \"batch_ms_p50\": " << QuantileOf(result->batch_ms, 0.5)
            << ", \"batch_ms_p99\": " << QuantileOf(result->batch_ms, 0.99)
            << ", \"reads\": " << result->calls << ", \"batches\": " << result->batches << "}"
            << std::endl;
  return {};
}

Status RunRounds(
    int atlas_port, int http_port, const fs::path& directory, int rounds, int milliseconds) {
  const std::vector<LoadTile> tiles = ReadTiles(directory);
  if (tiles.size() < 64) {
    return {StatusCode::kInvalidArgument, "expected at least 64 tiles"};
  }
  const auto atlas = MakeAtlasProtocol();
  const auto http = MakeHttpProtocol();
  const Server servers[] = {{"atlas", *atlas, static_cast<std::uint16_t>(atlas_port)},
                            {"nginx", *http, static_cast<std::uint16_t>(http_port)}};
  for (int round = -1; round < rounds; ++round) {  // the first one warms up
    for (const Case& run : kCases) {
      for (int i = 0; i < 2; ++i) {
        const Server& server = servers[static_cast<std::size_t>((round + 1 + i) % 2)];
        ATLAS_RETURN_IF_ERROR(
            RunOnce(server, tiles, run, round, std::chrono::milliseconds(milliseconds)));
      }
    }
  }
  return {};
}

int Main(int argc, char** argv) {
  const std::vector<std::string> args(argv + 1, argv + argc);
  Status status(StatusCode::kInvalidArgument,
                "usage: serving_bench files SERVER DIRECTORY | run ATLAS_PORT HTTP_PORT DIRECTORY "
                "ROUNDS MILLISECONDS");
  if (args.size() == 3 && args[0] == "files") {
    status = WriteFiles(args[1], args[2]);
  } else if (args.size() == 6 && args[0] == "run") {
    status = RunRounds(std::atoi(args[1].c_str()), std::atoi(args[2].c_str()), args[3],
                       std::atoi(args[4].c_str()), std::atoi(args[5].c_str()));
  }
  return status.ok() ? 0 : Fail(status);
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  return atlas::testing::Main(argc, argv);
}
