// A backup in the place of the atlas of a daemon that does not run. docs/daemon.md, "Backups".
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

struct RestorePlan {
  std::filesystem::path backup;
  std::filesystem::path target;  // the atlas.db of a data directory
  bool replaces = false;         // an atlas that is there, which is kept under another name
  // Asked every few milliseconds; a failed status ends it.
  std::function<Status()> check_stop;
  // Bytes of the step under way: copied, or read back.
  std::function<void(std::uint64_t done, std::uint64_t total)> on_progress;
};

struct RestoreSummary {
  std::uint64_t revision = 0;  // of the backup, as are the next four
  std::uint64_t keyframes = 0;
  std::uint64_t tiles = 0;
  std::uint64_t bytes = 0;
  Bytes sha256;  // of its tiles, as in a DigestSummary
  std::uint64_t new_epoch = 0;
  std::uint64_t new_revision = 0;
  std::filesystem::path kept;  // the atlas.db that was there before; empty: none
  // Then, the log or the note of one that was there without it: writes that were acknowledged may
  // be in that log alone.
  std::vector<std::filesystem::path> left;
};

// Reads all of the backup before anything is written. kNotFound: there is none. kInvalidArgument:
// it is no file, or in use, or the target is no atlas.db. kInvalidData: no atlas, or damaged.
// kUnsupported: of another schema version. kConflict: a daemon runs there, or there is an atlas and
// it is not to be replaced.
Result<RestoreSummary> RestoreBackup(const RestorePlan& plan);

}  // namespace atlas
