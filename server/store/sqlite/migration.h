// From an older schema to this one (docs/formats/store.md).
#pragma once

#include "core/geometry/map_profile.h"
#include "server/store/sqlite/connection.h"

namespace atlas {

// The tables that came after version `from`, empty; inside of a transaction.
void AddTables(Connection& connection, std::int64_t from);

// Brings an atlas of an older schema up to date, in one transaction; does nothing to one that is.
void MigrateSchema(Connection& connection, const MapProfile& profile);

}  // namespace atlas
