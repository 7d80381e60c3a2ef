#include "server/service/fusion/survey_files.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <system_error>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

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
    : options_(options),
      profile_(profile),
      read_line_(std::move(read_line)),
      log_(std::move(log)),
      folder_(options.directory, options.max_bytes, options.min_free_bytes) {
  if (options_.directory.empty()) {
    is_sorted_ = true;
    return;
  }
  AtlasLine line;  // of no atlas, which believes none
  if (options_.max_bytes > 0) {
    auto read = read_line_();
    std::error_code error;
    std::string why;
    if (!read) {
      why = read.error().message();
    } else if (BuildHash() == 0) {
      why = "the program's own file cannot be read";
    } else if (fs::create_directories(options_.directory, error); error) {
      why = StrCat("cannot make ", options_.directory.string(), ": ", error.message());
    }
    if (!why.empty()) {
      log_(LogLevel::kWarning, "surveys are not kept on disk: " + why);
      is_sorted_ = true;
      return;
    }
    line = *std::move(read);
    is_on_ = true;
  }
  sorter_ = std::jthread([this, line = std::move(line)](const std::stop_token& stop) {
    SortFiles(line, stop);
    is_sorted_ = true;
  });
}

// What it throws is the end of no thread, as when one is written.
void SurveyFiles::SortFiles(const AtlasLine& line, const std::stop_token& stop) {
  try {
    const Status status = folder_.Sort(
        [&](const fs::path& path) {
          const auto header = ReadSurveyFileHeader(path);
          // One that was written meanwhile goes on from a start that is not in this line.
          return header && path == folder_.PathOf(header->key) &&
                 (IsOfLine(*header, line) || Find(header->key));
        },
        stop);
    if (!status.ok()) {
      Report(status.message());
    }
  } catch (const std::exception& error) {
    Report(error.what());
  }
}

// As the atlas is now.
std::optional<SurveyFileHeader> SurveyFiles::Find(std::uint64_t key) const {
  if (!is_on_) {
    return std::nullopt;
  }
  const auto header = ReadSurveyFileHeader(folder_.PathOf(key));
  if (!header || header->key != key) {
    return std::nullopt;
  }
  const auto line = read_line_();
  return line && IsOfLine(*header, *line) ? header : std::nullopt;
}

std::optional<KeptSurveys> SurveyFiles::Read(const TileId& id) {
  if (!is_on_) {
    return std::nullopt;
  }
  const std::uint64_t key = id.Key();
  if (const auto header = Find(key)) {
    if (const auto payload = ReadSurveyFile(folder_.PathOf(key), *header)) {
      auto surveys = TileSurveys::Load(*payload, id, profile_);
      if (surveys) {
        folder_.Touch(key);
        return KeptSurveys{*std::move(surveys), header->revision, header->revision};
      }
    }
  }
  folder_.Remove(key);
  return std::nullopt;
}

bool SurveyFiles::Write(const KeptSurveys& kept) {
  if (!is_on_ || !MayWrite() || !folder_.HasRoom()) {
    return false;
  }
  const std::uint64_t key = kept.surveys.id().Key();
  std::error_code none_before;
  const std::uintmax_t before = fs::file_size(folder_.PathOf(key), none_before);
  const auto header = WriteFile(kept);
  if (!header) {
    Report(header.error().message());
    return false;
  }
  folder_.Put(key, SurveyFileBytes(*header), none_before ? 0 : before);
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
    std::error_code ignored;  // somebody removed it; else writing says what is wrong
    fs::create_directories(options_.directory, ignored);
    Status status = WriteSurveyFile(folder_.PathOf(header.key), folder_.UnfinishedOf(header.key),
                                    header, payload);
    return status.ok() ? Result<SurveyFileHeader>(header) : Error(std::move(status));
  } catch (const std::exception& error) {
    return Error(StatusCode::kInternal, error.what());
  }
}

bool SurveyFiles::Has(const KeptSurveys& kept) const {
  const auto header = Find(kept.surveys.id().Key());
  return header && header->revision == kept.revision;
}

bool SurveyFiles::MayWrite() const {
  const std::lock_guard lock(mutex_);
  return std::chrono::steady_clock::now() >= not_before_;
}

void SurveyFiles::MakeRoom() {
  if (is_on_) {
    folder_.HasRoom();
  }
}

void SurveyFiles::Report(const std::string& what) {
  const std::lock_guard lock(mutex_);
  not_before_ = std::chrono::steady_clock::now() + kPause;
  log_(LogLevel::kWarning, StrCat("surveys on disk: ", what, "; tried again in a minute"));
}

}  // namespace atlas
