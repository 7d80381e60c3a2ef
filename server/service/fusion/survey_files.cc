#include "server/service/fusion/survey_files.h"

#include <algorithm>
#include <iterator>
#include <system_error>
#include <utility>

#include "core/base/str_cat.h"
#include "server/service/fusion/survey_file.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr const char* kSuffix = ".survey";
constexpr const char* kUnfinished = ".survey-new";
constexpr std::chrono::minutes kPause{1};

}  // namespace

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
    FindFiles();  // none is of this line of the atlas, or will be known not to be
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
    const auto header = ReadSurveyFileHeader(path);
    if (header && path == PathOf(header->key) && IsOfThisAtlas(*header)) {
      found.push_back(
          {fs::last_write_time(path, ignored), {header->key, SurveyFileBytes(*header)}});
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
bool SurveyFiles::IsOfThisAtlas(const SurveyFileHeader& header) const {
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
  const auto file = ReadSurveyFile(PathOf(id.Key()));
  if (file && file->header.key == id.Key() && IsOfThisAtlas(file->header)) {
    auto surveys = TileSurveys::Load(file->payload, id, profile_);
    if (surveys) {
      return KeptSurveys{*std::move(surveys), file->header.revision, file->header.revision};
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
  const SurveyFileHeader header{BuildHash(), starts_.back().id, kept.revision,
                                kept.surveys.id().Key(), payload.size()};
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = writes_++;
  }
  const fs::path unfinished = options_.directory / StrCat(header.key, ".", number, kUnfinished);
  const Status status = WriteSurveyFile(PathOf(header.key), unfinished, header, payload);
  if (!status.ok()) {
    Report(status.message());
    return false;
  }
  kept.revision_on_disk = kept.revision;
  const std::lock_guard lock(mutex_);
  Insert({header.key, SurveyFileBytes(header)});
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
