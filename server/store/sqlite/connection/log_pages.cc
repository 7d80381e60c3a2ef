#include "server/store/sqlite/connection/log_pages.h"

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "core/base/bytes.h"

namespace atlas {
namespace {

constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kFrameHeaderBytes = 24;
constexpr std::size_t kSaltsOfHeader = 16;
constexpr std::size_t kSaltsOfFrame = 8;
constexpr std::uint64_t kLockByte = 0x4000'0000;  // the page with it is never used

class OpenFile {
 public:
  explicit OpenFile(const std::filesystem::path& file)
      : fd_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {}
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  int fd() const { return fd_; }

 private:
  int fd_;
};

bool ReadAt(int fd, std::uint64_t at, std::span<std::uint8_t> bytes) {
  return ::pread(fd, bytes.data(), bytes.size(), static_cast<off_t>(at)) ==
         static_cast<ssize_t>(bytes.size());
}

std::uint64_t U64At(ByteSpan bytes, std::size_t at) {
  return ByteReader(bytes.subspan(at)).U64();
}

std::uint64_t PageOf(ByteSpan frame_header) {
  return std::uint64_t{frame_header[0]} << 24U | std::uint64_t{frame_header[1]} << 16U |
         std::uint64_t{frame_header[2]} << 8U | frame_header[3];
}

// Whether each page from `first` on is in the log, by its distance.
std::vector<bool> FindPages(const std::filesystem::path& log,
                            std::uint64_t first,
                            std::uint64_t pages,
                            std::uint64_t page_bytes) {
  std::vector<bool> found(pages - first + 1);
  const OpenFile file(log);
  const std::uint64_t salts = ReadLogSalts(file.fd());
  std::array<std::uint8_t, kFrameHeaderBytes> header{};
  for (std::uint64_t at = kHeaderBytes;
       ReadAt(file.fd(), at, header) && U64At(header, kSaltsOfFrame) == salts;
       at += kFrameHeaderBytes + page_bytes) {
    const std::uint64_t page = PageOf(header);
    if (page >= first && page <= pages) {
      found[page - first] = true;
    }
  }
  return found;
}

}  // namespace

std::uint64_t ReadLogSalts(int fd) {
  std::array<std::uint8_t, 8> salts{};
  return ReadAt(fd, kSaltsOfHeader, salts) ? U64At(salts, 0) : 0;
}

std::uint64_t ReadLogSalts(const std::filesystem::path& log) {
  return ReadLogSalts(OpenFile(log).fd());
}

std::optional<std::uint64_t> FindMissingPage(const std::filesystem::path& database,
                                             std::uint64_t pages,
                                             std::uint64_t page_bytes) {
  std::error_code error;
  const std::uint64_t first = std::filesystem::file_size(database, error) / page_bytes + 1;
  if (error || first > pages) {
    return std::nullopt;
  }
  const std::vector<bool> found = FindPages(database.string() + "-wal", first, pages, page_bytes);
  for (std::uint64_t page = first; page <= pages; ++page) {
    if (!found[page - first] && page != kLockByte / page_bytes + 1) {
      return page;
    }
  }
  return std::nullopt;
}

}  // namespace atlas
