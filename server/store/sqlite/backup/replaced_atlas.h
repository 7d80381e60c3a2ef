// What becomes of an atlas that another one takes the place of: it is kept beside it.
#pragma once

#include <filesystem>
#include <string_view>

#include "core/base/status.h"

namespace atlas {

// Between the name of a database and the number of one that is kept.
inline constexpr std::string_view kReplaced = ".replaced-";

// `database` and what SQLite keeps beside it are called database.replaced-N, by the first number
// behind all that there are, durably; the name is returned, empty where there was nothing. Nothing
// that is kept is written over. Where a restore `was_interrupted`, what it left of the atlas that
// it moved follows that one, if it lacks it. After an error all is where it was, as far as the disk
// lets it. The caller holds the directory.
Result<std::filesystem::path> MoveAside(const std::filesystem::path& database,
                                        bool was_interrupted);

}  // namespace atlas
