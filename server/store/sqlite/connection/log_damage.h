// Damage in the write-ahead log, looked for before SQLite reads it: SQLite takes the first frame
// that is not as it was written for the end, and drops whatever was committed behind it without a
// word (https://www.sqlite.org/fileformat2.html, "The Write-Ahead Log").
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/base/status.h"

namespace atlas {

// A bit that turned: turned back, all that it was in is as it was written.
struct TurnedBit {
  std::uint64_t byte = 0;  // of the file
  std::uint8_t mask = 0;
};

struct LogDamage {
  // In the log's header, and one in each of any number of frames; only where no other bit would do
  // as well: the sums lose the highest bits of words.
  std::vector<TurnedBit> turned;
  std::uint64_t frame = 0;  // the first one that is not as it was written, or with a bit turned
  // Behind it and with it; they were committed, and are lost. 0: something was being written when
  // the process or the system stopped, and nobody was told that it is there.
  std::uint64_t lost_commits = 0;
  // Something is behind the end that SQLite finds.
  bool has_rest = false;
};

// Of the log at `path`, none if there is none. Commits are written one after the other and synced
// each, so of two of them behind damage the first was on disk. Of one alone that is sure only where
// the system has run on since it was written (`ran_since`): a power cut leaves such a rest. A kill
// leaves a frame that is not whole, as the last one. What a single bit makes whole is damage, and
// nothing is lost by it (docs/decisions/0506-a-damaged-log.md).
// kUnavailable when the log cannot be read.
Result<LogDamage> FindLogDamage(const std::filesystem::path& path, bool ran_since);

// Turns them back in the log at `path`. kUnavailable when it cannot be written.
Status TurnBack(const std::filesystem::path& path, const std::vector<TurnedBit>& bits);

// Whether the system has not started since the file was changed last.
bool HasRunSince(const std::filesystem::path& path);

}  // namespace atlas
