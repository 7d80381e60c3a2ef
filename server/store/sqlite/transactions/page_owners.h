// Whose pages those are that a start, and what comes behind it, writes to.
#pragma once

#include <filesystem>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Where a bit of the number of a table's first page turned, what is found there are rows of another
// table: to put them right would be to destroy those. So where of the marks, the counters or the
// sessions there are some and none is whole, all of the file is read; else little.
//
// kInvalidData: a page is one of two tables. Takes a connection that knows row_hash (row_hash.h),
// of an atlas from kFirstReadableVersion on. Throws as the connection does.
Status CheckPagesAreTheirs(Connection& connection);

// Where a bit of how many pages there are turned, those behind that end are in use, and the next
// new ones are written over them: SQLite takes what the header of the file says, or the log.
//
// kInvalidData: the file of the database goes on behind its last page. Throws as the connection
// does.
Status CheckEnd(Connection& connection, const std::filesystem::path& database);

}  // namespace atlas
