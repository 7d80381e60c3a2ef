// What the headers of a write-ahead log and of its frames tell, without SQLite: which log it is,
// and which pages it has.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace atlas {

// The salts of the log that is open as `fd`: other ones from each of its beginnings on. 0: nothing
// is in it, or it cannot be read.
std::uint64_t ReadLogSalts(int fd);
std::uint64_t ReadLogSalts(const std::filesystem::path& log);

// The first of `pages` pages of `page_bytes` each that is neither in the file of the database nor
// in its log; such a page was never there, and SQLite reads zeros. Frames count that are not whole,
// too. None: all are there, or the database cannot be looked at.
std::optional<std::uint64_t> FindMissingPage(const std::filesystem::path& database,
                                             std::uint64_t pages,
                                             std::uint64_t page_bytes);

}  // namespace atlas
