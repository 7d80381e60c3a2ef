#include "server/service/backup/backup_keeper.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"
#include "core/geometry/keyframe_key.h"
#include "core/tile/tile_codec.h"
#include "server/store/await.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kPartial = ".partial";
// What SQLite calls files that belong to another one.
constexpr std::array<std::string_view, 4> kTaken = {kPartial, "-wal", "-shm", "-journal"};

Status CheckName(const std::string& name) {
  ATLAS_RETURN_IF_ERROR(ValidateName("backup", name));
  const bool is_taken = name.starts_with('.') ||
                        std::any_of(kTaken.begin(), kTaken.end(),
                                    [&name](const auto suffix) { return name.ends_with(suffix); });
  return is_taken ? Status(StatusCode::kInvalidArgument,
                           StrCat("backup '", name,
                                  "': expected a name that begins with no dot, "
                                  "nor ends with .partial, -wal, -shm, -journal"))
                  : Status();
}

std::string Hex(const std::array<std::uint8_t, 32>& bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 15U];
  }
  return text;
}

std::int64_t UnixMs(fs::file_time_type time) {
  const auto since = std::chrono::file_clock::to_sys(time).time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(since).count();
}

}  // namespace

BackupKeeper::BackupKeeper(AtlasStore& store, LogSink log, BackupOptions options)
    : store_(store), log_(std::move(log)), options_(std::move(options)) {
  if (options_.folder.empty()) {
    return;
  }
  std::error_code error;
  for (fs::directory_iterator entry(options_.folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.ends_with(kPartial) && entry->is_regular_file(error)) {
      fs::remove(entry->path(), error);
      log_(LogLevel::kInfo, StrCat("backup: ", name, " was not finished, and is removed"));
    }
  }
  if (error) {
    log_(LogLevel::kWarning, DiskError("backup folder", options_.folder, error.value()).message());
  }
}

Status BackupKeeper::CheckFolder() const {
  if (options_.folder.empty()) {
    return {StatusCode::kInvalidArgument,
            "this daemon keeps no backups: its setting backup.folder names no folder"};
  }
  std::error_code error;
  if (fs::is_directory(options_.folder, error)) {
    return {};
  }
  return error ? DiskError("backup folder", options_.folder, error.value())
               : Status(StatusCode::kConflict,
                        StrCat("backup folder ", options_.folder.string(), ": is no folder"));
}

Result<AtlasFacts> BackupKeeper::Write(const BackupRequest& request, BackupWork work) {
  if (Status status = CheckName(request.name); !status.ok()) {
    return Error(std::move(status));
  }
  if (Status status = CheckFolder(); !status.ok()) {
    return Error(std::move(status));
  }
  const std::unique_lock only_one(writing_, std::try_to_lock);
  if (!only_one) {
    return Error(StatusCode::kUnavailable, "another backup is being written");
  }
  work.payload_of = TilePayloadFromBlob;
  work.bytes_per_s = options_.bytes_per_s;
  work.reserve_bytes = options_.reserve_bytes;
  Result<AtlasFacts> facts = store_.WriteBackup(options_.folder / request.name, work);
  if (facts) {
    Note(request, *facts);
  }
  return facts;
}

// What is there is there, whether it can be noted or not.
void BackupKeeper::Note(const BackupRequest& request, const AtlasFacts& facts) {
  BackupNote note{
      request.author, request.name,
      StrCat("revision ", facts.revision, ", ", facts.bytes, " bytes, digest ", Hex(facts.sha256))};
  const auto noted =
      Await<bool>([&](auto done) { store_.NoteBackup(std::move(note), std::move(done)); });
  if (!noted) {
    log_(LogLevel::kWarning, StrCat("backup: ", request.name,
                                    " is written, and not in the log: ", noted.error().message()));
  }
}

Result<std::vector<StoredBackup>> BackupKeeper::List() const {
  if (Status status = CheckFolder(); !status.ok()) {
    return Error(std::move(status));
  }
  std::vector<StoredBackup> backups;
  std::error_code error;
  for (fs::directory_iterator entry(options_.folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::error_code gone;
    if (!CheckName(name).ok() || !entry->is_regular_file(gone)) {
      continue;
    }
    const std::uint64_t bytes = entry->file_size(gone);
    const fs::file_time_type time = entry->last_write_time(gone);
    if (!gone) {
      backups.push_back({name, bytes, UnixMs(time)});
    }
  }
  if (error) {
    return Error(DiskError("backup folder", options_.folder, error.value()));
  }
  std::sort(backups.begin(), backups.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return backups;
}

}  // namespace atlas
