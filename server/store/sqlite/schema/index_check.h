// Whether indexes have what their tables have, and rows are found by their numbers: where they do
// not, searches give wrong answers without an error. Reads no blobs: a part of what integrity_check
// reads, of an atlas of whole scans a small one.
#pragma once

#include <functional>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

using StructureCheck = std::function<Status(Connection&)>;

// `run` runs a check in a snapshot of its own. kInvalidData names each table or index that is
// damaged. A failed status of `check_stop`, which is asked every some rows, ends it.
Status CheckStructure(const std::function<Status(const StructureCheck&)>& run,
                      const std::function<Status()>& check_stop);

}  // namespace atlas
