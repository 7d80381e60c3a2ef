// Text files of numbers, a line of them after the other.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"

namespace atlas {

// Without their ends ("\n" or "\r\n"), and without blank ones at the end of the file. Errors as
// ReadFileBytes, for a file above 256 MiB too.
Result<std::vector<std::string>> ReadLines(const std::filesystem::path& path);

// All numbers of a line, between blanks and tabs; nullopt when something else stands there, or more
// than 64 numbers.
std::optional<std::vector<double>> ParseNumbers(std::string_view line);

}  // namespace atlas
