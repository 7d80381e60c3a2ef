// Load on one server for a while: some connections, each with one batch of requests under way at a
// time, on one thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "tests/bench/serving/load_protocol.h"
#include "tests/bench/serving/load_socket.h"

namespace atlas::testing {

struct LoadOptions {
  std::uint16_t port = 0;
  const LoadTls* tls = nullptr;  // null: in the clear
  int connections = 16;
  std::size_t tiles_per_batch = 1;
  LoadMode mode = LoadMode::kFetch;
  std::chrono::milliseconds time{2'000};
  std::uint64_t seed = 1;  // of the order of the tiles, which are asked for in turn
};

struct LoadResult {
  double seconds = 0.0;
  std::uint64_t batches = 0;
  std::uint64_t tiles = 0;       // asked for and answered
  std::uint64_t tile_bytes = 0;  // of those that were sent
  std::vector<float> batch_ms;   // from the request to the last byte, each
  std::uint64_t wire_bytes = 0;  // received
  std::uint64_t calls = 0;       // to read
};

// kUnavailable: it refuses, or closes; kInvalidData: it answers something else.
Result<LoadResult> RunLoad(LoadProtocol& protocol,
                           std::span<const LoadTile> tiles,
                           const LoadOptions& options);

}  // namespace atlas::testing
