// What becomes of an atlas that another one takes the place of: it is kept beside it.
#pragma once

#include <filesystem>

#include "core/base/status.h"

namespace atlas {

// `database` and what SQLite keeps beside it are called database.replaced-1, or the next number
// that is free, durably; the name is returned, empty where there was nothing. The log of an atlas
// that was moved before, by one who was interrupted, follows it. After an error all is where it
// was, as far as the disk lets it.
Result<std::filesystem::path> MoveAside(const std::filesystem::path& database);

}  // namespace atlas
