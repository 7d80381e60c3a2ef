// The tables (docs/formats/store.md), and the checks before a file is believed to be an atlas.
#pragma once

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

inline constexpr std::int64_t kStoreApplicationId = 0x52414131;  // "RAA1"
inline constexpr std::int64_t kStoreSchemaVersion = 6;
// From this one on all rows are today's, and can be read as they are.
inline constexpr std::int64_t kFirstReadableVersion = 5;

// Makes the tables of an empty database, with nothing in them but counters of nothing.
void CreateTables(Connection& connection);
// The same, and writes who it is, in one transaction.
void CreateSchema(Connection& connection, const StoreIdentity& identity);

// From 1 to kStoreSchemaVersion. kInvalidData on a database of another program, kUnsupported on
// any other version.
Result<std::int64_t> ReadSchemaVersion(Connection& connection);
// Of whichever version: what all of them have. kInvalidData where it is damaged.
Result<StoreIdentity> ReadMeta(Connection& connection);
// Of an atlas of today's version, inside a transaction.
void WriteEpoch(Connection& connection, const StoreIdentity& identity, std::uint64_t epoch);
// The same as ReadMeta, but kUnsupported on a version before kFirstReadableVersion, too, and
// kInvalidData on another schema than an atlas has. Of a connection that may take any, and takes
// whole ones only from then on.
Result<StoreIdentity> ReadIdentity(Connection& connection);

// Writes a page as it is, inside a transaction, which then has to reach the disk: SQLite writes
// none of a row that stays what it was.
void WriteUnchanged(Connection& connection);

// kInvalidData naming an index that is gone from an atlas of today's version.
Status CheckIndexes(Connection& connection);
// Makes those that are gone anew, inside a transaction. How many.
int RestoreIndexes(Connection& connection);

}  // namespace atlas
