#include "server/service/fusion/survey_folder.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <random>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr const char* kSuffix = ".survey";
constexpr const char* kUnfinished = ".survey-new";

std::int64_t Signed(std::uintmax_t bytes) {
  return static_cast<std::int64_t>(
      std::min<std::uintmax_t>(bytes, std::numeric_limits<std::int64_t>::max()));
}

std::uint64_t RandomNumber() {
  std::random_device random;
  return std::uint64_t{random()} << 32 | random();
}

// Of a whole file.
std::optional<std::uint64_t> KeyOf(const fs::path& path) {
  const std::string name = path.stem().string();
  std::uint64_t key = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), key);
  const bool is_number = error == std::errc() && end == name.data() + name.size();
  return is_number && path.extension() == kSuffix ? std::optional(key) : std::nullopt;
}

}  // namespace

SurveyFolder::SurveyFolder(fs::path directory, std::size_t max_bytes, std::uintmax_t min_free_bytes)
    : directory_(std::move(directory)),
      max_bytes_(Signed(max_bytes)),
      min_free_bytes_(min_free_bytes),
      ours_(StrCat(".", RandomNumber(), "-")) {}

fs::path SurveyFolder::PathOf(std::uint64_t key) const {
  return directory_ / StrCat(key, kSuffix);
}

fs::path SurveyFolder::UnfinishedOf(std::uint64_t key) {
  return directory_ / StrCat(key, ours_, writes_++, kUnfinished);
}

Status SurveyFolder::Sort(const std::function<bool(const fs::path&)>& stays,
                          const std::stop_token& stop) {
  std::error_code error;
  for (fs::directory_iterator it(directory_, error), end;
       !error && it != end && !stop.stop_requested(); it.increment(error)) {
    const fs::path& path = it->path();
    std::error_code ignored;  // of files that are gone
    const bool is_left_over = path.extension() == kUnfinished &&
                              path.filename().string().find(ours_) == std::string::npos;
    if (is_left_over || (path.extension() == kSuffix && !stays(path))) {
      fs::remove(path, ignored);
    } else if (KeyOf(path)) {
      const std::uintmax_t bytes = fs::file_size(path, ignored);
      bytes_ += ignored ? 0 : Signed(bytes);
    }
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    return Status(StatusCode::kUnavailable,
                  StrCat("cannot list ", directory_.string(), ": ", error.message()));
  }
  if (bytes_ > max_bytes_) {
    RemoveOldestUntil([this](std::int64_t left_bytes) { return left_bytes <= max_bytes_; });
  }
  return {};
}

void SurveyFolder::Touch(std::uint64_t key) const {
  std::error_code ignored;  // it seems older than it is then
  fs::last_write_time(PathOf(key), fs::file_time_type::clock::now(), ignored);
}

void SurveyFolder::Put(std::uint64_t key, std::uintmax_t bytes, std::uintmax_t bytes_before) {
  Touch(key);  // the system's own times are coarse
  bytes_ += Signed(bytes) - Signed(bytes_before);
  if (bytes_ > max_bytes_) {
    // Some more, so that not every file has all listed.
    const std::int64_t enough_bytes = max_bytes_ - max_bytes_ / 16;
    RemoveOldestUntil([&](std::int64_t left_bytes) { return left_bytes <= enough_bytes; });
  }
}

void SurveyFolder::Remove(std::uint64_t key) {
  std::error_code ignored;  // it is gone, or it is not believed, or overwritten, later
  const std::uintmax_t bytes = fs::file_size(PathOf(key), ignored);
  if (fs::remove(PathOf(key), ignored)) {
    bytes_ -= Signed(bytes);
  }
}

bool SurveyFolder::HasRoom() {
  const auto has_room = [this] {
    std::error_code error;
    const fs::space_info space = fs::space(directory_, error);
    return error || space.available >= min_free_bytes_;
  };
  if (has_room()) {
    return true;
  }
  RemoveOldestUntil([&](std::int64_t) { return has_room(); });
  return has_room();
}

// What is put meanwhile may be counted twice: until the next time.
void SurveyFolder::RemoveOldestUntil(const std::function<bool(std::int64_t)>& is_enough) {
  struct File {
    fs::file_time_type used_at;
    std::int64_t bytes = 0;
    std::uint64_t key = 0;
  };
  const std::unique_lock lock(removing_, std::try_to_lock);
  if (!lock) {
    return;  // somebody is at it
  }
  const std::int64_t before_bytes = bytes_;
  std::int64_t left_bytes = 0;
  std::vector<File> files;
  std::error_code error;
  for (fs::directory_iterator it(directory_, error), end; !error && it != end;
       it.increment(error)) {
    const auto key = KeyOf(it->path());
    std::error_code gone;
    File file{it->last_write_time(gone), 0, key.value_or(0)};
    file.bytes = gone ? 0 : Signed(it->file_size(gone));
    if (key && !gone) {
      left_bytes += file.bytes;
      files.push_back(file);
    }
  }
  std::sort(files.begin(), files.end(),
            [](const File& a, const File& b) { return a.used_at < b.used_at; });
  for (const File& file : files) {
    if (is_enough(left_bytes)) {
      break;
    }
    std::error_code ignored;  // tried again the next time
    if (fs::remove(PathOf(file.key), ignored)) {
      left_bytes -= file.bytes;
    }
  }
  bytes_ += left_bytes - before_bytes;
}

std::size_t SurveyFolder::bytes() const {
  return static_cast<std::size_t>(std::max<std::int64_t>(bytes_, 0));
}

}  // namespace atlas
