// Counters against the rows they count.
#pragma once

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// kInvalidData names a table that is another one than an atlas has, or the first counter that is
// damaged or not what the rows say, the table that lost rows, or what of an index or of the file's
// pages is not as it should be.
Status CheckCounters(Connection& connection);

// Writes counters that are damaged or missing anew, inside of a transaction: from the rows where
// they tell, the others so far above all that rows tell that no number is given twice. An event
// names them. The value: how many.
int RestoreCounters(Connection& connection);
// Writes what the rows say into the counters that say something else. How many.
int RecountCounters(Connection& connection);

}  // namespace atlas
