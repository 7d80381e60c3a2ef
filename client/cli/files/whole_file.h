// Files that appear whole or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

// With its parents; fine when it exists. kPermissionDenied, kConflict when a file has its name.
Status MakeDirectory(const std::filesystem::path& directory);

// Whether a file may stand or be made there: kNotFound, kPermissionDenied, kConflict for a folder.
Status CheckPlace(const std::filesystem::path& path);

// Written beside `path` and renamed over it.
Status WriteWholeFile(const std::filesystem::path& path, ByteSpan bytes);
Status WriteTextFile(const std::filesystem::path& path, std::string_view text);

// Also of a pipe. kNotFound, kPermissionDenied, kInvalidData for a folder; kResourceExhausted above
// `max_bytes`.
Result<std::string> ReadWholeFile(const std::filesystem::path& path, std::uint64_t max_bytes);

}  // namespace atlas
