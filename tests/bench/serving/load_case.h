// What a server is asked for in a run, and a run's figures as a JSON line.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/base/status.h"
#include "tests/bench/serving/load_run.h"

namespace atlas::testing {

inline constexpr std::size_t kTilesPerBatch = 64;

struct LoadCase {
  const char* name;
  LoadMode mode;
  std::size_t tiles_per_batch;
};

inline constexpr LoadCase kLoadCases[] = {{"single", LoadMode::kFetch, 1},
                                          {"pipelined", LoadMode::kFetch, kTilesPerBatch},
                                          {"not_modified_single", LoadMode::kNotModified, 1},
                                          {"not_modified", LoadMode::kNotModified, kTilesPerBatch}};

// Null: there is none of this name.
const LoadCase* FindLoadCase(const std::string& name);

struct LoadServer {
  const char* name;
  LoadProtocol& protocol;
};

// One run, printed. `options` says where and how long. An answer that is none, or tiles where none
// or without tiles where some are expected, is an error.
Status RunCase(const LoadServer& server,
               const LoadCase& run,
               std::span<const LoadTile> tiles,
               int round,
               LoadOptions options);

}  // namespace atlas::testing
