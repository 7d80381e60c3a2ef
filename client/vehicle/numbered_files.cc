#include "client/vehicle/numbered_files.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <system_error>

#include "client/vehicle/stored_file.h"
#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDigits = 16;
// No spool comes so far; a file named above it is not ours, and numbers never outgrow their digits.
constexpr std::uint64_t kMaxNumber = 1'000'000'000'000'000;

std::optional<std::uint64_t> NumberFrom(std::string_view name, std::string_view suffix) {
  if (name.size() != kDigits + suffix.size() || !name.ends_with(suffix)) return std::nullopt;
  std::uint64_t number = 0;
  const char* end = name.data() + kDigits;
  const auto [stop, error] = std::from_chars(name.data(), end, number);
  const bool is_number = error == std::errc() && stop == end && number <= kMaxNumber;
  return is_number ? std::optional(number) : std::nullopt;
}

}  // namespace

std::string NumberedName(std::uint64_t number, std::string_view suffix) {
  const std::string digits = std::to_string(number);
  return StrCat(std::string(kDigits - std::min(kDigits, digits.size()), '0'), digits, suffix);
}

Result<std::map<std::uint64_t, std::uint64_t>> NumberedFiles(const fs::path& folder,
                                                             std::string_view suffix) {
  std::map<std::uint64_t, std::uint64_t> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::error_code unreadable;  // it is none of ours, or cannot be removed, and is met again
    if (name.ends_with(kPartialSuffix)) fs::remove(entry->path(), unreadable);
    const auto number = NumberFrom(name, suffix);
    const std::uint64_t bytes = entry->file_size(unreadable);
    if (number && !unreadable) files[*number] = bytes;
  }
  if (error) return Error(DiskError("cannot read folder", folder, error.value()));
  return files;
}

}  // namespace atlas
