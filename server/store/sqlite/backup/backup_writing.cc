#include "server/store/sqlite/backup/backup_writing.h"

#include <exception>
#include <system_error>
#include <utility>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"
#include "server/store/sqlite/backup/atlas_copy.h"
#include "server/store/sqlite/backup/atlas_reading.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/table_sums.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr int kCache_kib = 1024;  // each page is read once
constexpr int kBusyTimeout_ms = 5'000;

// What the copy must hold.
struct Original {
  std::uint64_t revision = 0;
  std::uint64_t table_sums = 0;
};

Result<Original> CopyState(const fs::path& database,
                           const fs::path& backup,
                           const BackupWork& work) {
  Connection source({database, DatabaseOptions::Mode::kReadOnly, kCache_kib, kBusyTimeout_ms});
  const Snapshot snapshot(source);
  const Original original{ReadCounter(source, Counter::kRevision), HashOfTableSums(source)};
  const auto bytes =
      static_cast<std::uint64_t>(source.Ask("PRAGMA page_count") * source.Ask("PRAGMA page_size"));
  Status status = RequireRoom(backup.parent_path(), bytes, work.reserve_bytes);
  if (status.ok()) {
    status = CopyAtlas(source, backup, work);
  }
  return status.ok() ? Result<Original>(original) : Error(std::move(status));
}

Result<AtlasFacts> CopyAndCheck(const fs::path& database,
                                const fs::path& backup,
                                const BackupWork& work) {
  const Result<Original> original = CopyState(database, backup, work);
  if (!original) {
    return Error(original.error());
  }
  Result<AtlasFacts> facts = ReadAtlasBack(PartialOf(backup), work);
  if (!facts) {
    return Error(facts.error().WithContext("the copy was read back"));
  }
  if (facts->revision != original->revision || facts->table_sums != original->table_sums) {
    return Error(StatusCode::kInvalidData,
                 StrCat("the copy is of revision ", facts->revision, " and not what the atlas of ",
                        original->revision, " is"));
  }
  if (Status published = PublishCopy(backup); !published.ok()) {
    std::error_code ignored;  // who was told of a failure does not look for it
    fs::remove(backup, ignored);
    return Error(std::move(published));
  }
  return facts;
}

Status CheckFree(const fs::path& backup) {
  std::error_code error;
  const fs::file_status found = fs::symlink_status(backup, error);
  if (found.type() == fs::file_type::not_found) {
    return {};
  }
  return error ? DiskError("cannot look at", backup, error.value())
               : Status(StatusCode::kConflict, StrCat(backup.string(), " is there already"));
}

}  // namespace

Result<AtlasFacts> WriteAtlasBackup(const fs::path& database,
                                    const fs::path& backup,
                                    const BackupWork& work) {
  if (Status status = CheckFree(backup); !status.ok()) {
    return Error(status.WithContext("backup"));
  }
  Result<AtlasFacts> facts = Error(StatusCode::kInternal, "");
  try {
    facts = CopyAndCheck(database, backup, work);
  } catch (const std::exception& error) {
    facts = Error(StatusFromException(error));
  }
  if (facts) {
    return facts;
  }
  RemovePartial(backup);
  return Error(facts.error().WithContext("backup"));
}

}  // namespace atlas
