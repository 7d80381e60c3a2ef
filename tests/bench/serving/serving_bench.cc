// Load on the daemon, beside a server of static files or alone: one JSON line a run.
// Usage: serving_bench files SERVER DIRECTORY [CA]    writes every tile of an atlas as a file
//        serving_bench run ATLAS_PORT HTTP_PORT DIRECTORY ROUNDS MILLISECONDS [tls]
//        serving_bench load ATLAS_PORT DIRECTORY CASE CONNECTIONS ROUND MILLISECONDS [tls]
// A round of `run` is each case once with each server, in turns. CA: the certificate of a daemon
// that speaks TLS.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/str_cat.h"
#include "tests/bench/serving/load_case.h"
#include "tests/bench/serving/tile_files.h"

namespace atlas::testing {
namespace {

using Arguments = std::vector<std::string>;

std::uint16_t PortOf(const std::string& text) {
  return static_cast<std::uint16_t>(std::atoi(text.c_str()));
}

Status WriteFiles(const Arguments& args) {
  const auto endpoint = Endpoint::Parse(args[0]);
  if (!endpoint) {
    return endpoint.error();
  }
  ConnectionOptions daemon;
  daemon.endpoint = *endpoint;
  if (args.size() > 2) {
    daemon.tls = ConnectionTls{args[2], {}, {}, {}};
  }
  return WriteTileFiles(daemon, args[1]);
}

// As both servers are spoken to.
struct Way {
  std::optional<LoadTls> tls;
  LoadOptions options;

  Way(int milliseconds, bool is_tls) {
    if (is_tls) {
      options.tls = &tls.emplace();
    }
    options.time = std::chrono::milliseconds(milliseconds);
  }
};

Status RunRounds(const Arguments& args) {
  const auto tiles = ReadTileList(args[2]);
  if (!tiles) {
    return tiles.error();
  }
  const auto atlas = MakeAtlasProtocol();
  const auto http = MakeHttpProtocol();
  const LoadServer servers[] = {{"atlas", *atlas}, {"nginx", *http}};
  const std::uint16_t ports[] = {PortOf(args[0]), PortOf(args[1])};
  Way way(std::atoi(args[4].c_str()), args.size() > 5);
  for (int round = -1; round < std::atoi(args[3].c_str()); ++round) {  // the first one warms up
    for (const LoadCase& run : kLoadCases) {
      for (int i = 0; i < 2; ++i) {
        const auto which = static_cast<std::size_t>((round + 1 + i) % 2);
        way.options.port = ports[which];
        ATLAS_RETURN_IF_ERROR(RunCase(servers[which], run, *tiles, round, way.options));
      }
    }
  }
  return {};
}

Status RunLoadOnce(const Arguments& args) {
  const auto tiles = ReadTileList(args[1]);
  if (!tiles) {
    return tiles.error();
  }
  const LoadCase* const run = FindLoadCase(args[2]);
  if (run == nullptr) {
    return {StatusCode::kInvalidArgument, StrCat("there is no case ", args[2])};
  }
  const auto atlas = MakeAtlasProtocol();
  Way way(std::atoi(args[5].c_str()), args.size() > 6);
  way.options.port = PortOf(args[0]);
  way.options.connections = std::atoi(args[3].c_str());
  return RunCase({"atlas", *atlas}, *run, *tiles, std::atoi(args[4].c_str()), way.options);
}

struct Mode {
  const char* name;
  std::size_t arguments;  // and one more at most
  Status (*run)(const Arguments& args);
};
constexpr Mode kModes[] = {
    {"files", 2, &WriteFiles}, {"run", 5, &RunRounds}, {"load", 6, &RunLoadOnce}};

int Main(int argc, char** argv) {
  const Arguments args(argv + std::min(argc, 2), argv + argc);
  const std::string name = argc > 1 ? argv[1] : "";
  for (const Mode& mode : kModes) {
    if (name == mode.name && (args.size() == mode.arguments || args.size() == mode.arguments + 1)) {
      const Status status = mode.run(args);
      if (!status.ok()) {
        std::cerr << "serving_bench: " << status.message() << "\n";
      }
      return status.ok() ? 0 : 1;
    }
  }
  std::cerr << "usage: serving_bench files SERVER DIRECTORY [CA] | run ATLAS_PORT HTTP_PORT "
               "DIRECTORY ROUNDS MILLISECONDS [tls] | load ATLAS_PORT DIRECTORY CASE CONNECTIONS "
               "ROUND MILLISECONDS [tls]\n";
  return 2;
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to servers that are gone, too
  return atlas::testing::Main(argc, argv);
}
