// Rows that vanish leave nothing that could be damaged: of each table it is kept how many rows it
// has, and the XOR of their checksums. Whoever changes the tables by other means than a connection
// that keeps them is found out.
#pragma once

#include <cstdint>
#include <functional>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {

// Says of every table what it holds now.
void WriteTableSums(Connection& connection);
void WriteTableSum(Connection& connection, RowKind table);
// From now on the transactions of this connection keep them, and it writes in no other way.
void KeepTableSums(Connection& connection);
// The same of a table that was written anew. Nothing where the connection counts none.
void KeepTableSum(Connection& connection, RowKind table);

// Runs `restore`, which makes rows what they were written as: their table holds what it should
// then, and nothing is counted.
void WithoutCounting(Connection& connection, RowKind table, const std::function<void()>& restore);

// One number for what all tables should hold.
std::uint64_t HashOfTableSums(Connection& connection);

// Reads the checksums of all rows, without their blobs. kInvalidData names the table that lost rows
// or has others than were written.
Status CheckTableSums(Connection& connection);
Status CheckTableSum(Connection& connection, RowKind table);

}  // namespace atlas
