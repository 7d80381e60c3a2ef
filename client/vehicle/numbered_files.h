// Files of a folder whose names are numbers that rise in the order in which they were written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "core/base/status.h"

namespace atlas {

// 16 decimal digits and the suffix.
std::string NumberedName(std::uint64_t number, std::string_view suffix);

// The bytes of each; what writes that never ended left is removed. Fails when the folder cannot be
// read to its end: whoever goes on without the rest would take numbers that are taken.
Result<std::map<std::uint64_t, std::uint64_t>> NumberedFiles(const std::filesystem::path& folder,
                                                             std::string_view suffix);

}  // namespace atlas
