#include "server/service/fusion/survey_files.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "core/base/hash.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kMagic = 0x3130'5652'5553'4152;  // "RASURV01"
constexpr std::size_t kHeaderBytes = 64;
constexpr const char* kSuffix = ".survey";
constexpr const char* kUnfinished = ".survey-new";
constexpr std::chrono::minutes kPause{1};

Result<Bytes> ReadWhole(const fs::path& path, std::size_t max_bytes) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) {
    return Error(StatusCode::kNotFound, StrCat(path.string(), ": ", error.message()));
  }
  Bytes bytes(static_cast<std::size_t>(std::min<std::uintmax_t>(size, max_bytes)));
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file) {
    return Error(StatusCode::kUnavailable, StrCat("cannot read ", path.string()));
  }
  return bytes;
}

std::error_code LastError() {
  return {errno, std::generic_category()};
}

bool WriteAll(int fd, ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) {
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
  }
  return true;
}

// Waits for the disk: else the next transaction of the atlas, whose upload waits for its
// acknowledgement, would have to.
std::error_code WriteParts(const fs::path& path, std::initializer_list<ByteSpan> parts) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) {
    return LastError();
  }
  const bool is_written =
      std::all_of(parts.begin(), parts.end(), [fd](ByteSpan part) { return WriteAll(fd, part); }) &&
      ::fdatasync(fd) == 0;
  const std::error_code error = is_written ? std::error_code() : LastError();
  ::close(fd);
  return error;
}

// Of the running program: surveys are those of its code, and packed as it lays them out. 0 if it
// cannot be found out.
std::uint64_t BuildHash() {
  static const std::uint64_t hash = [] {
    constexpr std::size_t kMaxProgram = std::size_t{4} << 30;
    const auto program = ReadWhole("/proc/self/exe", kMaxProgram);
    return program ? Hash64(*program) : 0;
  }();
  return hash;
}

}  // namespace

struct SurveyFiles::Header {
  std::uint64_t build = 0;
  std::array<std::uint8_t, 16> start{};  // during which it was written
  std::uint64_t revision = 0;
  std::uint64_t key = 0;
  std::uint64_t payload_bytes = 0;

  // Of all but the hash at its end, which is of this and of the payload.
  Bytes Encode() const {
    ByteWriter out;
    out.U64(kMagic);
    out.U64(build);
    out.Raw(start);
    out.U64(revision);
    out.U64(key);
    out.U64(payload_bytes);
    return out.Take();
  }

  static std::optional<Header> Decode(ByteSpan bytes) {
    ByteReader in(bytes);
    Header header;
    const bool is_ours = in.U64() == kMagic;
    header.build = in.U64();
    const ByteSpan start = in.Raw(header.start.size());
    header.revision = in.U64();
    header.key = in.U64();
    header.payload_bytes = in.U64();
    if (!is_ours || !in.ok()) {
      return std::nullopt;
    }
    std::copy(start.begin(), start.end(), header.start.begin());
    return header;
  }
};

SurveyFiles::SurveyFiles(const SurveyFilesOptions& options,
                         const MapProfile& profile,
                         std::vector<AtlasStart> starts,
                         LogSink log)
    : options_(options), profile_(profile), starts_(std::move(starts)), log_(std::move(log)) {
  if (options_.directory.empty() || options_.max_bytes == 0) {
    return;
  }
  if (starts_.empty() || BuildHash() == 0) {
    log_(LogLevel::kWarning,
         "surveys are not kept on disk: the disk refused to note this start, or the program's own "
         "file cannot be read");
    return;
  }
  std::error_code error;
  fs::create_directories(options_.directory, error);
  if (error) {
    log_(LogLevel::kWarning, StrCat("surveys are not kept on disk: cannot make ",
                                    options_.directory.string(), ": ", error.message()));
    return;
  }
  is_on_ = true;
  FindFiles();
}

void SurveyFiles::FindFiles() {
  struct Found {
    fs::file_time_type time;
    Entry entry;
  };
  std::vector<Found> found;
  std::error_code error;
  for (fs::directory_iterator it(options_.directory, error), end; !error && it != end;
       it.increment(error)) {
    const fs::path& path = it->path();
    if (path.extension() != kSuffix && path.extension() != kUnfinished) {
      continue;  // not ours
    }
    std::error_code ignored;
    const auto size = static_cast<std::size_t>(fs::file_size(path, ignored));
    const auto bytes = ReadWhole(path, kHeaderBytes);
    const auto header = bytes ? Header::Decode(*bytes) : std::nullopt;
    if (header && path == PathOf(header->key) && size == kHeaderBytes + header->payload_bytes &&
        IsOfThisAtlas(*header)) {
      found.push_back({fs::last_write_time(path, ignored), {header->key, size}});
    } else {
      fs::remove(path, ignored);
    }
  }
  if (error) {
    Report(StrCat("cannot list ", options_.directory.string(), ": ", error.message()));
  }
  std::sort(found.begin(), found.end(),
            [](const Found& a, const Found& b) { return a.time < b.time; });
  const std::lock_guard lock(mutex_);
  for (const Found& file : found) {
    Insert(file.entry);
  }
}

// Whether the atlas went on from the state that it was in when the file was written.
bool SurveyFiles::IsOfThisAtlas(const Header& header) const {
  const auto start = std::find_if(starts_.begin(), starts_.end(),
                                  [&](const AtlasStart& s) { return s.id == header.start; });
  if (header.build != BuildHash() || start == starts_.end()) {
    return false;
  }
  return std::next(start) == starts_.end() || header.revision <= std::next(start)->revision;
}

fs::path SurveyFiles::PathOf(std::uint64_t key) const {
  return options_.directory / StrCat(key, kSuffix);
}

std::optional<KeptSurveys> SurveyFiles::Read(const TileId& id) {
  {
    const std::lock_guard lock(mutex_);
    const auto found = by_key_.find(id.Key());
    if (found == by_key_.end()) {
      return std::nullopt;
    }
    by_age_.splice(by_age_.begin(), by_age_, found->second);
  }
  const auto bytes = ReadWhole(PathOf(id.Key()), options_.max_bytes);
  if (bytes && bytes->size() > kHeaderBytes) {
    const ByteSpan head = ByteSpan(*bytes).first(kHeaderBytes - 8);
    const ByteSpan payload = ByteSpan(*bytes).subspan(kHeaderBytes);
    const auto header = Header::Decode(head);
    ByteReader hash(ByteSpan(*bytes).subspan(kHeaderBytes - 8, 8));
    if (header && header->key == id.Key() && IsOfThisAtlas(*header) &&
        hash.U64() == (Hash64(head) ^ Hash64(payload))) {
      auto surveys = TileSurveys::Load(payload, id, profile_);
      if (surveys) {
        return KeptSurveys{*std::move(surveys), header->revision, header->revision};
      }
    }
  }
  const std::lock_guard lock(mutex_);
  Remove(id.Key());
  return std::nullopt;
}

bool SurveyFiles::Write(KeptSurveys& kept) {
  if (!is_on_ || kept.revision == kept.revision_on_disk || !HasRoom()) {
    return false;
  }
  const Bytes payload = kept.surveys.Save();
  const std::uint64_t key = kept.surveys.id().Key();
  const Status status = WriteFile(key, kept.revision, payload);
  if (!status.ok()) {
    Report(status.message());
    return false;
  }
  kept.revision_on_disk = kept.revision;
  const std::lock_guard lock(mutex_);
  Insert({key, kHeaderBytes + payload.size()});
  return true;
}

bool SurveyFiles::HasRoom() {
  {
    const std::lock_guard lock(mutex_);
    if (std::chrono::steady_clock::now() < not_before_) {
      return false;
    }
  }
  std::error_code error;
  const fs::space_info space = fs::space(options_.directory, error);
  return error || space.available >= options_.min_free_bytes;
}

Status SurveyFiles::WriteFile(std::uint64_t key, std::uint64_t revision, ByteSpan payload) {
  const Bytes head = Header{BuildHash(), starts_.back().id, revision, key, payload.size()}.Encode();
  ByteWriter hash;
  hash.U64(Hash64(head) ^ Hash64(payload));
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = writes_++;
  }
  const fs::path unfinished = options_.directory / StrCat(key, ".", number, kUnfinished);
  std::error_code error = WriteParts(unfinished, {head, hash.bytes(), payload});
  if (!error) {
    fs::rename(unfinished, PathOf(key), error);
  }
  if (!error) {
    return {};
  }
  std::error_code ignored;
  fs::remove(unfinished, ignored);
  return Status(StatusCode::kUnavailable,
                StrCat("cannot write ", PathOf(key).string(), ": ", error.message()));
}

// Under the lock, as is Remove().
void SurveyFiles::Insert(const Entry& entry) {
  if (const auto old = by_key_.find(entry.key); old != by_key_.end()) {
    bytes_ -= old->second->bytes;
    by_age_.erase(old->second);
  }
  by_age_.push_front(entry);
  by_key_[entry.key] = by_age_.begin();
  bytes_ += entry.bytes;
  while (bytes_ > options_.max_bytes) {
    Remove(by_age_.back().key);
  }
}

void SurveyFiles::Remove(std::uint64_t key) {
  const auto found = by_key_.find(key);
  if (found == by_key_.end()) {
    return;
  }
  bytes_ -= found->second->bytes;
  by_age_.erase(found->second);
  by_key_.erase(found);
  std::error_code ignored;  // it is not believed, or overwritten, later
  fs::remove(PathOf(key), ignored);
}

void SurveyFiles::Report(const std::string& what) {
  const std::lock_guard lock(mutex_);
  not_before_ = std::chrono::steady_clock::now() + kPause;
  log_(LogLevel::kWarning, StrCat("surveys on disk: ", what, "; tried again in a minute"));
}

std::size_t SurveyFiles::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace atlas
