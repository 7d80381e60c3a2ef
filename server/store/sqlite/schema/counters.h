// Numbers that every transaction keeps up to date, so that nobody has to count rows.
#pragma once

#include <cstdint>

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Frozen: row ids of table counters.
enum class Counter : std::uint8_t {
  kRevision = 1,
  kBatch = 2,
  kLastKeyframeId = 3,
  kKeyframes = 4,
  kKeyframeBytes = 5,
  kTiles = 6,
  kTileBytes = 7,
  kCells = 8,
  kMultilayerCells = 9,
  kSessions = 10,
  kHistoryHorizon = 11,  // the oldest revision that can still be read
  kCompactions = 12,
  kCompacted = 13,    // keyframes that they dropped
  kFusionRules = 14,  // by which the tiles are fused; 0: nobody said
  kEvents = 15,
};

// All of them throw what becomes kInvalidData when the counter is damaged or missing.
std::uint64_t ReadCounter(Connection& connection, Counter counter);
// The value after adding `delta`.
std::uint64_t AddToCounter(Connection& connection, Counter counter, std::int64_t delta);
// The number of the next row of those that a counter numbers: behind the counter, and none that a
// damaged row has, as `find` tells, a statement with one parameter. The counter stays what it is.
std::uint64_t NextNumber(Connection& connection, Counter counter, const char* find);
// The same, and the counter says so.
std::uint64_t TakeNumber(Connection& connection, Counter counter, const char* find);
// Whatever it was before.
void SetCounter(Connection& connection, Counter counter, std::uint64_t value);

// It is there, and as it was written.
bool IsCounterIntact(Connection& connection, Counter counter);
// Adds it if it is missing.
void RewriteCounter(Connection& connection, Counter counter, const char* name, std::uint64_t value);

}  // namespace atlas
