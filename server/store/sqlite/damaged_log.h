// What is done about damage in the log of an atlas before and after SQLite reads it
// (docs/decisions/0506-a-damaged-log.md).
#pragma once

#include <filesystem>
#include <string>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/log_damage.h"

namespace atlas {

struct DamagedLog {
  std::filesystem::path kept;  // a copy, if anything was done to it
  LogDamage damage;

  bool is_lossy() const { return damage.lost_commits > 0; }
};

// Turns bits back in it where that mends it. Before that, and before SQLite drops what is behind
// other damage, a copy is kept, once of each such log: who knows better can look at it.
// kUnavailable: the disk.
Result<DamagedLog> MendLog(const std::filesystem::path& log);

// For people.
std::string LossOf(const DamagedLog& log);

// Leaves nothing behind the last commit that SQLite finds in the log at `log`: what is written
// there would stand before it, and it would be taken for commits that are lost. Readers go on.
// Throws as the connection does.
void DropRest(Connection& writer, const std::filesystem::path& log);

}  // namespace atlas
