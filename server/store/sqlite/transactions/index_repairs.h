// Indexes that do not have what their tables have, as what happens inside a savepoint.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// TableRepair::kIndexes. How much was not as it should be, with the indexes as one.
Result<std::uint32_t> RepairIndexes(Connection& connection,
                                    std::uint8_t levels,
                                    const std::string& author);

}  // namespace atlas
