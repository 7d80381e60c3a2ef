// Keyframes dropped for good: what the store is told, and what it did.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace atlas {

struct Compaction {
  std::uint64_t at_revision = 0;      // at which tiles were found not to need `dropped`
  std::int64_t before_ms = 0;         // what was asked for, kept for people
  std::vector<std::int64_t> dropped;  // ids of keyframes, each once
  std::string author;
};

struct CompactionResult {
  std::uint64_t dropped = 0;   // keyframes
  std::uint64_t bytes = 0;     // of their blobs
  std::uint64_t horizon = 0;   // the oldest revision that can still be read
  std::uint64_t revision = 0;  // of the atlas, after it
};

}  // namespace atlas
