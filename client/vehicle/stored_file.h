// Files that appear whole or not at all: written beside their place and renamed into it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

// What is left of a write that never ended has this at the end of its name.
inline constexpr std::string_view kPartialSuffix = ".partial";

enum class Durability : std::uint8_t {
  kWhole,    // after a loss of power it may be damaged: for what can be had again
  kOnDevice  // on the device before the call returns, its name too
};

// In place of what is there. kResourceExhausted on a full disk, kPermissionDenied, else
// kUnavailable; nothing is left then.
Status StoreFile(const std::filesystem::path& path, ByteSpan bytes, Durability durability);
// The same on the device, where nothing is: kConflict, and what is there stays.
Status StoreNewFile(const std::filesystem::path& path, ByteSpan bytes);
// kNotFound, kInvalidData above `max_bytes` (nobody wrote that), else what the disk said.
Result<Bytes> LoadFile(const std::filesystem::path& path, std::uint64_t max_bytes);
// With its parents; fine when it exists. Its name is settled on the device.
Status MakeFolder(const std::filesystem::path& folder);
// Renames within a file system; both names are settled on the device. kConflict: there is a file
// already, and both stay.
Status MoveFile(const std::filesystem::path& from, const std::filesystem::path& to);

// The bytes with their Hash64 behind them, and back. kInvalidData when it does not match.
Bytes WithChecksum(Bytes bytes);
Result<ByteSpan> WithoutChecksum(ByteSpan bytes);

}  // namespace atlas
