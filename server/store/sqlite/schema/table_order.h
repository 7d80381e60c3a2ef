// Tables whose rows are not in the order of their numbers, or are not found by them: a bit of such
// a number turned, in the row or on the way to it. SQLite searches by that order; no index made
// anew mends it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Checks as those of index_check.h, of all tables.
void AddOrderChecks(const std::function<Status()>& check_stop,
                    std::vector<std::function<Status(Connection&)>>& checks);

enum class OrderedTables { kCounters, kTiles, kFootprints, kOthers };

struct OrderedTable {
  std::string name;
  std::size_t left_out = 0;  // rows; of tables without numbers 0
};

// Of the rows of table keyframes, in the order in which they lie: their numbers, where something
// tells them better than they do.
using KeyframeNumbers = std::function<std::vector<std::int64_t>(Connection&)>;

// Writes such tables anew, with all their blobs, in a transaction. A number out of order becomes
// the one between its neighbours that is one bit away. A row for which there is none is left out,
// one that lacks a value that each of its table has, and one of footprints or tombstones whose
// checksum is wrong; of footprints the index of changes tells what it was. Which tables.
std::vector<OrderedTable> PutTablesInOrder(Connection& connection,
                                           OrderedTables which,
                                           const KeyframeNumbers& keyframes);

}  // namespace atlas
