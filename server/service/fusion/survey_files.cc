#include "server/service/fusion/survey_files.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr const char* kSuffix = ".survey";
constexpr const char* kUnfinished = ".survey-new";
constexpr std::chrono::minutes kPause{1};

// Whether the atlas went on from the state that it was in when the file was written.
bool IsOfLine(const SurveyFileHeader& header, const AtlasLine& line) {
  const auto start = std::find_if(line.starts.begin(), line.starts.end(),
                                  [&](const AtlasStart& s) { return s.id == header.start; });
  if (header.build != BuildHash() || start == line.starts.end()) {
    return false;
  }
  const auto next = std::next(start);
  return header.revision <= (next == line.starts.end() ? line.revision : next->revision);
}

}  // namespace

SurveyFiles::SurveyFiles(const SurveyFilesOptions& options,
                         const MapProfile& profile,
                         ReadLine read_line,
                         LogSink log)
    : options_(options), profile_(profile), read_line_(std::move(read_line)), log_(std::move(log)) {
  if (options_.directory.empty()) {
    return;
  }
  if (options_.max_bytes == 0) {
    FindFiles({});
    return;
  }
  const auto line = read_line_();
  std::error_code error;
  std::string why;
  if (!line) {
    why = line.error().message();
  } else if (BuildHash() == 0) {
    why = "the program's own file cannot be read";
  } else if (fs::create_directories(options_.directory, error); error) {
    why = StrCat("cannot make ", options_.directory.string(), ": ", error.message());
  }
  if (!why.empty()) {
    log_(LogLevel::kWarning, "surveys are not kept on disk: " + why);
    return;
  }
  is_on_ = true;
  FindFiles(*line);
}

void SurveyFiles::FindFiles(const AtlasLine& line) {
  struct Found {
    fs::file_time_type time;
    SurveyFileHeader header;
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
    if (header && path == PathOf(header->key) && header->payload_bytes <= options_.max_bytes &&
        IsOfLine(*header, line)) {
      found.push_back({fs::last_write_time(path, ignored), *header});
    } else {
      fs::remove(path, ignored);
    }
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    Report(StrCat("cannot list ", options_.directory.string(), ": ", error.message()));
  }
  std::sort(found.begin(), found.end(),
            [](const Found& a, const Found& b) { return a.time < b.time; });
  const std::lock_guard lock(mutex_);
  for (const Found& file : found) {
    Insert(file.header);
  }
}

fs::path SurveyFiles::PathOf(std::uint64_t key) const {
  return options_.directory / StrCat(key, kSuffix);
}

std::optional<KeptSurveys> SurveyFiles::Read(const TileId& id) {
  SurveyFileHeader header;
  {
    const std::lock_guard lock(mutex_);
    const SurveyFileHeader* found = files_.Use(id.Key());
    if (found == nullptr) {
      return std::nullopt;
    }
    header = *found;
  }
  if (const auto payload = ReadSurveyFile(PathOf(header.key), header)) {
    auto surveys = TileSurveys::Load(*payload, id, profile_);
    if (surveys) {
      std::error_code ignored;  // its age after a restart is a guess then
      fs::last_write_time(PathOf(header.key), fs::file_time_type::clock::now(), ignored);
      return KeptSurveys{*std::move(surveys), header.revision};
    }
  }
  const std::lock_guard lock(mutex_);
  if (const SurveyFileHeader* now = files_.Use(header.key); now != nullptr && *now == header) {
    files_.Take(header.key);
    RemoveFile(header.key);
  }
  return std::nullopt;
}

bool SurveyFiles::Write(const KeptSurveys& kept) {
  if (!is_on_ || !MayWrite() || !HasRoom()) {
    return false;
  }
  const auto header = WriteFile(kept);
  if (!header) {
    Report(header.error().message());
    return false;
  }
  const std::lock_guard lock(mutex_);
  Insert(*header);
  return true;
}

// What it throws (no memory, say) is the end of no thread: it can be done without.
Result<SurveyFileHeader> SurveyFiles::WriteFile(const KeptSurveys& kept) {
  try {
    const auto line = read_line_();
    if (!line) {
      return Error(line.error());
    }
    if (line->starts.empty()) {
      return Error(StatusCode::kInvalidData, "the last start of the atlas is damaged");
    }
    const Bytes payload = kept.surveys.Save();
    const SurveyFileHeader header{BuildHash(), line->starts.back().id, kept.revision,
                                  kept.surveys.id().Key(), payload.size()};
    std::uint64_t number = 0;
    {
      const std::lock_guard lock(mutex_);
      number = writes_++;
    }
    std::error_code ignored;  // somebody removed it; else writing says what is wrong
    fs::create_directories(options_.directory, ignored);
    const fs::path unfinished = options_.directory / StrCat(header.key, ".", number, kUnfinished);
    Status status = WriteSurveyFile(PathOf(header.key), unfinished, header, payload);
    return status.ok() ? Result<SurveyFileHeader>(header) : Error(std::move(status));
  } catch (const std::exception& error) {
    return Error(StatusCode::kInternal, error.what());
  }
}

bool SurveyFiles::Has(const KeptSurveys& kept) const {
  const std::lock_guard lock(mutex_);
  const SurveyFileHeader* found = files_.Find(kept.surveys.id().Key());
  return found != nullptr && found->revision == kept.revision;
}

bool SurveyFiles::MayWrite() const {
  const std::lock_guard lock(mutex_);
  return std::chrono::steady_clock::now() >= not_before_;
}

void SurveyFiles::MakeRoom() {
  if (is_on_) {
    HasRoom();
  }
}

bool SurveyFiles::HasRoom() {
  const std::lock_guard lock(mutex_);
  while (true) {
    std::error_code error;
    const fs::space_info space = fs::space(options_.directory, error);
    if (error || space.available >= options_.min_free_bytes) {
      return true;
    }
    const auto oldest = files_.TakeOldestAbove(0);
    if (!oldest) {
      return false;
    }
    RemoveFile(oldest->key);
  }
}

// Under the lock.
void SurveyFiles::Insert(const SurveyFileHeader& header) {
  files_.Insert(header.key, header, SurveyFileBytes(header));
  while (const auto oldest = files_.TakeOldestAbove(options_.max_bytes)) {
    RemoveFile(oldest->key);
  }
}

void SurveyFiles::RemoveFile(std::uint64_t key) const {
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
  return files_.bytes();
}

}  // namespace atlas
