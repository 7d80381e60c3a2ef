#include "server/store/sqlite/connection/log_damage.h"

#include <array>
#include <bit>
#include <chrono>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "core/base/bytes.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kFrameHeaderBytes = 24;
constexpr std::uint32_t kMagic = 0x377f0682;  // its lowest bit: words of sums are big-endian
constexpr std::uint32_t kSmallestPage = 512;
constexpr std::uint32_t kLargestPage = 65'536;

std::uint32_t BigEndian(ByteSpan bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 |
         std::uint32_t{bytes[at + 2]} << 8 | std::uint32_t{bytes[at + 3]};
}

std::uint32_t LittleEndian(ByteSpan bytes, std::size_t at) {
  return std::uint32_t{bytes[at + 3]} << 24 | std::uint32_t{bytes[at + 2]} << 16 |
         std::uint32_t{bytes[at + 1]} << 8 | std::uint32_t{bytes[at]};
}

// The running sum of a log.
class LogSum {
 public:
  explicit LogSum(bool is_big_endian) : is_big_endian_(is_big_endian) {}

  void Add(ByteSpan words) {
    for (std::size_t at = 0; at + 8 <= words.size(); at += 8) {
      first_ += Word(words, at) + second_;
      second_ += Word(words, at + 4) + first_;
    }
  }
  bool Is(ByteSpan bytes, std::size_t at) const {
    return BigEndian(bytes, at) == first_ && BigEndian(bytes, at + 4) == second_;
  }
  // Of `words` before this sum was taken; or of the sum at `at` of `bytes`. Whether one bit that is
  // turned makes them fit.
  bool IsOneBitOff(ByteSpan words, ByteSpan bytes, std::size_t at) const {
    const std::uint32_t first = BigEndian(bytes, at) - first_;
    const std::uint32_t second = BigEndian(bytes, at + 4) - second_;
    if (std::popcount(BigEndian(bytes, at) ^ first_) +
            std::popcount(BigEndian(bytes, at + 4) ^ second_) ==
        1) {
      return true;
    }
    // What one more in a word makes of both numbers at the end, from the last word back.
    std::array<std::uint32_t, 2> of_first{1, 1};
    std::array<std::uint32_t, 2> of_second{0, 1};
    for (std::size_t pair = words.size() / 8; pair-- > 0;) {
      for (const auto& [effect, offset] :
           {std::pair(of_first, 8 * pair), std::pair(of_second, 8 * pair + 4)}) {
        const std::uint32_t word = Word(words, offset);
        for (std::uint32_t bit = 1; bit != 0; bit <<= 1) {
          const std::uint32_t change = (word & bit) == 0 ? bit : 0u - bit;
          if (effect[0] * change == first && effect[1] * change == second) {
            return true;
          }
        }
      }
      of_first = {of_first[0] + of_first[1], of_first[0] + 2 * of_first[1]};
      of_second = {of_second[0] + of_second[1], of_second[0] + 2 * of_second[1]};
    }
    return false;
  }

 private:
  std::uint32_t Word(ByteSpan bytes, std::size_t at) const {
    return is_big_endian_ ? BigEndian(bytes, at) : LittleEndian(bytes, at);
  }

  bool is_big_endian_;
  std::uint32_t first_ = 0;
  std::uint32_t second_ = 0;
};

struct LogHeader {
  std::size_t page_bytes = 0;
  std::array<std::uint32_t, 2> salts{};  // as those of every frame of this log have them
  std::optional<LogSum> sum;             // none: the header is damaged itself
};

bool IsPageSize(std::uint32_t bytes) {
  return bytes >= kSmallestPage && bytes <= kLargestPage && (bytes & (bytes - 1)) == 0;
}

std::array<std::uint32_t, 2> SaltsOf(ByteSpan frame) {
  return {BigEndian(frame, 8), BigEndian(frame, 12)};
}

// But for a damaged bit: another log has another second one, at random.
bool AreSame(const std::array<std::uint32_t, 2>& a, const std::array<std::uint32_t, 2>& b) {
  return std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) <= 1;
}

LogHeader ReadHeader(ByteSpan bytes) {
  LogHeader header;
  header.page_bytes = BigEndian(bytes, 8);
  header.salts = {BigEndian(bytes, 16), BigEndian(bytes, 20)};
  const std::uint32_t magic = BigEndian(bytes, 0);
  LogSum sum((magic & 1) != 0);
  sum.Add(bytes.first(24));
  if ((magic & ~1u) == kMagic && IsPageSize(BigEndian(bytes, 8)) && sum.Is(bytes, 24)) {
    header.sum = sum;
  }
  return header;
}

// Frame by frame.
class LogReading {
 public:
  explicit LogReading(const std::filesystem::path& path) : in_(path, std::ios::binary) {}

  bool is_open() const { return in_.is_open(); }
  bool Read(Bytes& bytes) {
    in_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return static_cast<std::size_t>(in_.gcount()) == bytes.size();
  }
  bool has_failed() const { return in_.bad(); }
  void Seek(std::size_t at) {
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(at));
  }

 private:
  std::ifstream in_;
};

// A damaged header does not say how long pages are: the first size at which the second frame has
// the salts of the first one does.
std::size_t GuessPageBytes(LogReading& log, std::array<std::uint32_t, 2>& salts) {
  Bytes first(kFrameHeaderBytes);
  Bytes second(kFrameHeaderBytes);
  log.Seek(kHeaderBytes);
  if (!log.Read(first)) {
    return 0;
  }
  salts = SaltsOf(first);
  for (std::size_t bytes = kSmallestPage; bytes <= kLargestPage; bytes *= 2) {
    log.Seek(kHeaderBytes + kFrameHeaderBytes + bytes);
    if (log.Read(second) && SaltsOf(second) == salts) {
      return bytes;
    }
  }
  return 0;
}

// Of the frame at which `sum` is.
bool IsFlipped(const LogSum& sum, ByteSpan frame, const std::array<std::uint32_t, 2>& salts) {
  if (SaltsOf(frame) != salts) {
    return sum.Is(frame, 16);  // but for the bit of a salt
  }
  Bytes words(frame.begin(), frame.begin() + 8);
  words.insert(words.end(), frame.begin() + kFrameHeaderBytes, frame.end());
  return sum.IsOneBitOff(words, frame, 16);
}

LogDamage Scan(LogReading& log, LogHeader header) {
  LogDamage damage;
  bool is_over = !header.sum;
  if (is_over) {
    header.page_bytes = GuessPageBytes(log, header.salts);
    if (header.page_bytes == 0) {
      return damage;  // one frame at most
    }
  }
  log.Seek(kHeaderBytes);
  Bytes frame(kFrameHeaderBytes + header.page_bytes);
  bool is_torn = false;  // the first one, and nothing of this log is behind it
  for (std::uint64_t number = 0; log.Read(frame); ++number) {
    const bool is_of_log = AreSame(SaltsOf(frame), header.salts);  // else of one before
    if (!is_over) {
      header.sum->Add(ByteSpan(frame).first(8));
      header.sum->Add(ByteSpan(frame).subspan(kFrameHeaderBytes));
      if (SaltsOf(frame) == header.salts && header.sum->Is(frame, 16)) {
        continue;
      }
      is_over = true;
      damage.frame = number;
      is_torn = is_of_log && !IsFlipped(*header.sum, frame, header.salts);
    } else if (is_of_log) {
      is_torn = false;
    }
    damage.has_rest = damage.has_rest || is_of_log;
    if (is_of_log && BigEndian(frame, 4) != 0) {
      ++damage.lost_commits;
    }
  }
  damage.lost_commits = is_torn ? 0 : damage.lost_commits;
  return damage;
}

}  // namespace

Result<LogDamage> FindLogDamage(const std::filesystem::path& path, bool ran_since) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error || size <= kHeaderBytes) {
    return LogDamage();
  }
  LogReading log(path);
  Bytes bytes(kHeaderBytes);
  if (!log.is_open() || !log.Read(bytes)) {
    return Error(StatusCode::kUnavailable, StrCat(path.string(), ": the log cannot be read"));
  }
  LogDamage damage = Scan(log, ReadHeader(bytes));
  if (log.has_failed()) {
    return Error(StatusCode::kUnavailable, StrCat(path.string(), ": the log cannot be read"));
  }
  if (damage.lost_commits == 1 && !ran_since) {
    damage.lost_commits = 0;
  }
  return damage;
}

bool HasRunSince(const std::filesystem::path& path) {
  constexpr std::chrono::seconds kRounding(2);
  std::ifstream in("/proc/stat");
  std::string word;
  std::int64_t started_s = 0;
  while (in >> word) {
    if (word == "btime" && in >> started_s) {
      break;
    }
  }
  std::error_code error;
  const auto changed = std::filesystem::last_write_time(path, error);
  if (error || started_s == 0) {
    return false;
  }
  const std::chrono::sys_seconds started{std::chrono::seconds(started_s)};
  const auto changed_at = std::chrono::file_clock::to_sys(changed);
  // A clock that went back tells nothing.
  return changed_at > started + kRounding &&
         changed_at < std::chrono::system_clock::now() + kRounding;
}

}  // namespace atlas
