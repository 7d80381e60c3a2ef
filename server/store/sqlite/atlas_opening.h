// From a directory to an atlas that can be written to: made if there is none, upgraded if it is of
// an earlier schema, and what every write counts on put right.
#pragma once

#include <memory>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/data_directory.h"
#include "server/store/sqlite/revision_note.h"
#include "server/store/sqlite/sqlite_store.h"

namespace atlas {

struct OpenedAtlas {
  StoreIdentity identity;
  std::unique_ptr<Connection> writer;
  bool may_have_purged = false;      // the log may have what was to be overwritten
  LogStart log;                      // that was found
  std::uint64_t revision_alone = 0;  // of the database without it
};

// Errors as OpenSqliteStore. The directory stays locked by the caller.
Result<OpenedAtlas> OpenAtlas(const DataDirectory& directory, const SqliteStoreOptions& options);

}  // namespace atlas
