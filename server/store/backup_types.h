// A copy of a whole atlas in one file: what writing, reading back and restoring one takes, and what
// it tells.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

struct BackupProgress {
  enum class Stage : std::uint8_t { kCopying = 1, kVerifying = 2 };

  Stage stage = Stage::kCopying;
  std::uint64_t done_bytes = 0;
  std::uint64_t total_bytes = 0;
};

// How a copy is made and read back.
struct BackupWork {
  // The canonical payload of a tile's blob, whose checksums it verifies.
  std::function<Result<Bytes>(ByteSpan)> payload_of;
  // Asked every few milliseconds; a failed status ends it.
  std::function<Status()> check_stop = [] {
    return Status();
  };
  // Told after every step.
  std::function<void(const BackupProgress&)> on_progress = [](const BackupProgress&) {
  };
  double bytes_per_s = 0;           // that are copied, and then read back; 0: as fast as it goes
  std::uint64_t reserve_bytes = 0;  // that stay free on the disk
};

// What was found in an atlas that was read back, all of it.
struct AtlasFacts {
  std::array<std::uint8_t, 16> atlas_id{};
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t tiles = 0;
  std::uint64_t bytes = 0;                // of the file
  std::uint64_t table_sums = 0;           // hash of the sums of all tables
  std::array<std::uint8_t, 32> sha256{};  // the digest of its tiles (tile_hasher.h)
};

// For people: which file, and what is in it.
struct BackupNote {
  std::string author;
  std::string name;
  std::string detail;
};

// A restore leaves so many revisions out: what was given after the backup, and is lost, is given to
// nothing else.
inline constexpr std::uint64_t kRevisionsLeftOut = std::uint64_t{1} << 32;
// How often revisions were left out before this one: more changes than that no atlas lives to see.
constexpr std::uint64_t LineOf(std::uint64_t revision) {
  return revision / kRevisionsLeftOut;
}

struct RestoreOrder {
  std::filesystem::path backup;
  std::filesystem::path target;  // the atlas.db of a data directory, which is made if need be
  bool replaces = false;         // an atlas that is there, which is kept under another name
  BackupWork work;
};

struct RestoredAtlas {
  AtlasFacts backup;
  std::uint64_t epoch = 0;     // from now on
  std::uint64_t revision = 0;  // likewise
  std::filesystem::path kept;  // the database that was there before; empty: none
  // Then, what was left of one, under names of its own: commits may be in that log alone.
  std::vector<std::filesystem::path> left;
};

}  // namespace atlas
