#include "server/store/sqlite/connection/log_damage.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

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
  // Of `words` before this sum was taken; or of the sum at `at` of `bytes`: the bits of which each
  // alone makes them fit when it is turned. Sums lose what the highest bits of words are: there may
  // be many.
  struct Bit {
    bool is_in_words = false;
    std::size_t byte = 0;  // of `words`, or of `bytes`
    std::uint8_t mask = 0;
  };
  std::vector<Bit> FindTurned(ByteSpan words, ByteSpan bytes, std::size_t at) const {
    std::vector<Bit> found;
    const std::uint32_t first = BigEndian(bytes, at) - first_;
    const std::uint32_t second = BigEndian(bytes, at + 4) - second_;
    const std::uint64_t stored =
        std::uint64_t{BigEndian(bytes, at)} << 32 | BigEndian(bytes, at + 4);
    const std::uint64_t differing = stored ^ (std::uint64_t{first_} << 32 | second_);
    if (std::popcount(differing) == 1) {
      const auto place = static_cast<std::size_t>(std::countl_zero(differing));
      found.push_back({false, at + place / 8, static_cast<std::uint8_t>(0x80u >> (place % 8))});
    }
    // What one more in a word makes of both numbers at the end, from the last word back.
    std::array<std::uint32_t, 2> of_first{1, 1};
    std::array<std::uint32_t, 2> of_second{0, 1};
    for (std::size_t pair = words.size() / 8; pair-- > 0;) {
      for (const auto& [effect, offset] :
           {std::pair(of_first, 8 * pair), std::pair(of_second, 8 * pair + 4)}) {
        const std::uint32_t word = Word(words, offset);
        for (std::size_t bit = 0; bit < 32; ++bit) {
          const std::uint32_t one = std::uint32_t{1} << bit;
          const std::uint32_t change = (word & one) == 0 ? one : 0u - one;
          if (effect[0] * change == first && effect[1] * change == second) {
            const std::size_t byte = is_big_endian_ ? 3 - bit / 8 : bit / 8;
            found.push_back({true, offset + byte, static_cast<std::uint8_t>(1u << (bit % 8))});
          }
        }
      }
      of_first = {of_first[0] + of_first[1], of_first[0] + 2 * of_first[1]};
      of_second = {of_second[0] + of_second[1], of_second[0] + 2 * of_second[1]};
    }
    return found;
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

// The header's bit that is turned, turned back in `bytes`, too: if it is one, and by the salts of
// the first frame no other. Which order of bytes sums are of may be what turned.
std::optional<TurnedBit> MendHeader(LogReading& log, Bytes& bytes) {
  Bytes first(kFrameHeaderBytes);
  log.Seek(kHeaderBytes);
  if (!log.Read(first)) {
    return std::nullopt;
  }
  std::vector<TurnedBit> fitting;
  for (const bool is_big_endian : {false, true}) {
    LogSum sum(is_big_endian);
    sum.Add(ByteSpan(bytes).first(24));
    for (const LogSum::Bit& bit : sum.FindTurned(ByteSpan(bytes).first(24), bytes, 24)) {
      Bytes mended = bytes;
      mended[bit.byte] ^= bit.mask;
      const LogHeader header = ReadHeader(mended);
      if (header.sum && header.salts == SaltsOf(first)) {
        fitting.push_back({bit.byte, bit.mask});
      }
    }
  }
  if (fitting.size() != 1) {
    return std::nullopt;
  }
  bytes[fitting.front().byte] ^= fitting.front().mask;
  return fitting.front();
}

LogSum Sum(LogSum before, ByteSpan frame) {
  before.Add(frame.first(8));
  before.Add(frame.subspan(kFrameHeaderBytes));
  return before;
}

Bytes SummedPart(ByteSpan frame) {
  Bytes words(8 + frame.size() - kFrameHeaderBytes);
  std::copy_n(frame.begin(), 8, words.begin());
  std::copy(frame.begin() + kFrameHeaderBytes, frame.end(), words.begin() + 8);
  return words;
}

bool IsWhole(const LogSum& sum, ByteSpan frame, const LogHeader& header) {
  return SaltsOf(frame) == header.salts && sum.Is(frame, 16);
}

// The only bit that makes `frame`, at which `sum` is, whole, by its place in the frame.
std::optional<TurnedBit> FindTurnedBit(const LogSum& sum, ByteSpan frame, const LogHeader& header) {
  const auto salts = SaltsOf(frame);
  const std::uint64_t differing =
      std::uint64_t{salts[0] ^ header.salts[0]} << 32 | (salts[1] ^ header.salts[1]);
  if (differing != 0) {
    const auto place = static_cast<std::size_t>(std::countl_zero(differing));
    const bool is_all = std::popcount(differing) == 1 && sum.Is(frame, 16);
    return is_all ? std::optional(
                        TurnedBit{8 + place / 8, static_cast<std::uint8_t>(0x80u >> (place % 8))})
                  : std::nullopt;
  }
  const auto found = sum.FindTurned(SummedPart(frame), frame, 16);
  if (found.size() != 1) {
    return std::nullopt;
  }
  const bool is_of_page = found.front().is_in_words && found.front().byte >= 8;
  return TurnedBit{found.front().byte + (is_of_page ? kFrameHeaderBytes - 8 : 0),
                   found.front().mask};
}

// Whether a bit makes it whole, be it one of several.
bool MayBeTurned(const LogSum& sum, ByteSpan frame, const LogHeader& header) {
  return SaltsOf(frame) == header.salts && !sum.FindTurned(SummedPart(frame), frame, 16).empty();
}

LogDamage Scan(LogReading& log, LogHeader header, LogDamage damage) {
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
      const LogSum before = *header.sum;
      header.sum = Sum(before, frame);
      if (IsWhole(*header.sum, frame, header)) {
        continue;
      }
      if (damage.turned.empty()) {
        damage.frame = number;
      }
      const auto turned = is_of_log ? FindTurnedBit(*header.sum, frame, header) : std::nullopt;
      if (turned) {
        frame[turned->byte] ^= turned->mask;
        header.sum = Sum(before, frame);
        const std::uint64_t at = kHeaderBytes + number * frame.size();
        damage.turned.push_back({at + turned->byte, turned->mask});
        continue;
      }
      is_over = true;
      damage.frame = number;
      is_torn = is_of_log && !MayBeTurned(*header.sum, frame, header);
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
  LogDamage damage;
  LogHeader header = ReadHeader(bytes);
  if (!header.sum) {
    if (const auto turned = MendHeader(log, bytes)) {
      damage.turned.push_back(*turned);
      header = ReadHeader(bytes);
    }
  }
  damage = Scan(log, header, std::move(damage));
  if (log.has_failed()) {
    return Error(StatusCode::kUnavailable, StrCat(path.string(), ": the log cannot be read"));
  }
  if (damage.lost_commits == 1 && !ran_since) {
    damage.lost_commits = 0;
  }
  return damage;
}

Status TurnBack(const std::filesystem::path& path, const std::vector<TurnedBit>& bits) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  for (const TurnedBit& bit : bits) {
    const auto at = static_cast<std::streamoff>(bit.byte);
    file.seekg(at);
    const int byte = file.get();
    file.seekp(at);
    file.put(static_cast<char>(byte ^ bit.mask));
  }
  file.flush();
  return file ? Status()
              : Status(StatusCode::kUnavailable,
                       StrCat(path.string(), ": damaged bits cannot be turned back"));
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
