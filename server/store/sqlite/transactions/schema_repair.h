// A schema whose text is damaged, put right before anything is read by it: which it was is known of
// every atlas.
#pragma once

#include <functional>
#include <string>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// What was put right, for people; empty: there was nothing, or the file is of a version that an
// upgrade reads first. In one transaction, which is kept where all that is stored is whole by the
// schema that was put back. Takes a connection that takes any schema and knows row_hash
// (row_hash.h); behind it, without an error, it takes whole ones only.
//
// `before_writing`, where it is set, is called, in no transaction, when the repair was tried, and
// before it is made.
//
// kInvalidData says what differs and why it stays: a table is gone, say, or there is other damage.
// Nothing was changed then, but for what `before_writing` did, if it was called: it may drop what
// was never committed. Throws as the connection does.
Result<std::string> RepairSchema(Connection& connection,
                                 const std::function<void()>& before_writing);

}  // namespace atlas
