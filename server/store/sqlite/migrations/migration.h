// From every earlier version of the schema to today's (docs/formats/store.md).
#pragma once

#include <cstdint>
#include <functional>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Brings an atlas of an earlier version up to date in one transaction, and notes that as an event;
// whatever ends it before leaves the atlas as it was. Nothing for one of today's. `on_begin`, where
// it is set, is told the version before.
//
// Takes a connection that knows row_hash (row_hash.h) and does not keep the sums of its tables yet;
// after an error it is to be closed. kUnsupported: of a version that is none, or a newer one.
// kInvalidData: another program's, of other tables than its version has, or damaged in what makes
// it an atlas; damaged rows elsewhere stop nothing, and stay damaged. Disk errors as of
// sqlite_error.h.
Status MigrateStore(Connection& connection, const std::function<void(std::int64_t)>& on_begin);

// The same for a version from kFirstReadableVersion on: there MigrateStore() changes nothing.
// Within the transaction that makes good what is damaged, of a connection that keeps the sums of
// its tables.
void FinishMigration(Connection& connection);

}  // namespace atlas
