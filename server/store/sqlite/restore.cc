#include "server/store/sqlite/restore.h"

#include <exception>
#include <string>
#include <system_error>
#include <utility>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"
#include "server/store/sqlite/backup/atlas_copy.h"
#include "server/store/sqlite/backup/atlas_reading.h"
#include "server/store/sqlite/backup/replaced_atlas.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/data_directory.h"
#include "server/store/sqlite/database_files.h"
#include "server/store/sqlite/former_place.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/transactions/new_line.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr const char* kAuthor = "atlas-restore";
constexpr const char* kAtlasName = "atlas.db";
constexpr int kCache_kib = 1024;

// The folder of the target; "." where only a name was given.
fs::path FolderOf(const fs::path& target) {
  return target.has_parent_path() ? target.parent_path() : fs::path(".");
}

Status CheckTarget(const RestoreOrder& order) {
  if (order.target.filename() != kAtlasName) {
    return {StatusCode::kInvalidArgument,
            StrCat(order.target.string(), " is none that a daemon reads: expected the ", kAtlasName,
                   " of its data directory")};
  }
  std::error_code error;
  const bool is_there = fs::exists(fs::symlink_status(order.target, error));
  if (is_there && fs::equivalent(order.backup, order.target, error)) {
    return {StatusCode::kInvalidArgument,
            StrCat(order.target.string(), " is the backup itself: expected another place")};
  }
  if (is_there && !order.replaces) {
    return {StatusCode::kConflict,
            StrCat("there is an atlas already, ", order.target.string(),
                   ": it is replaced on demand alone (--replace), and kept under another name")};
  }
  return {};
}

Result<DatabaseFiles> FindBackup(const fs::path& backup) {
  Result<DatabaseFiles> files = DatabaseFiles::Look(backup);
  if (files && !files->is_alone()) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat(backup.string(),
                        " has a log beside it: it is in use, or a daemon died on "
                        "it, and no backup"));
  }
  return files;
}

// A daemon that runs is found before all of the backup is read.
Status CheckIdle(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / "lock", error)) {
    return {};
  }
  const auto directory = DataDirectory::Lock(folder);
  return directory ? Status() : directory.error();
}

// The copy becomes an atlas that goes on by itself.
Status GoOn(const fs::path& target, const std::string& backup, RestoredAtlas& restored) {
  Connection connection({PartialOf(target), DatabaseOptions::Mode::kReadWrite, kCache_kib, 0});
  connection.Execute("PRAGMA journal_mode = MEMORY;");
  AddRowHash(connection);
  KeepTableSums(connection);
  connection.Begin();
  const Result<StoreIdentity> identity = ReadIdentity(connection);
  if (!identity) {
    return identity.error();
  }
  const PlaceInLine line = BeginLine(connection, *identity, FindFormerPlace(target, *identity));
  restored.epoch = line.epoch;
  restored.revision = line.revision;
  AddEvent(connection, {EventKind::kBackupRestored, kAuthor, backup,
                        StrCat("revision ", restored.backup.revision, " of epoch ",
                               restored.backup.epoch, ", now epoch ", restored.epoch)});
  connection.Commit();
  return {};
}

// The same tiles and keyframes, in their new epoch.
Status CheckCopy(const RestoredAtlas& restored, const AtlasFacts& copy) {
  const AtlasFacts& backup = restored.backup;
  const bool is_it = copy.sha256 == backup.sha256 && copy.tiles == backup.tiles &&
                     copy.keyframes == backup.keyframes && copy.atlas_id == backup.atlas_id &&
                     copy.epoch == restored.epoch && copy.revision == restored.revision;
  return is_it ? Status() : Status(StatusCode::kInvalidData, "the copy is not what the backup is");
}

Status MakeCopy(const RestoreOrder& order, const fs::path& target, RestoredAtlas& restored) {
  ATLAS_RETURN_IF_ERROR(
      RequireRoom(target.parent_path(), restored.backup.bytes, order.work.reserve_bytes));
  {
    Connection from({order.backup, DatabaseOptions::Mode::kUntouched, kCache_kib, 0});
    const Snapshot snapshot(from);
    ATLAS_RETURN_IF_ERROR(CopyAtlas(from, target, order.work));
  }
  ATLAS_RETURN_IF_ERROR(GoOn(target, order.backup.filename().string(), restored));
  const Result<AtlasFacts> copy = ReadAtlasBack(PartialOf(target), order.work);
  return copy ? CheckCopy(restored, *copy) : copy.error().WithContext("the copy was read back");
}

Status Replace(const fs::path& target, bool was_interrupted, RestoredAtlas& restored) {
  ATLAS_RETURN_IF_ERROR(SyncFolder(target.parent_path()));  // the copy is found by its name
  Result<KeptAtlas> kept = MoveAside(
      target, [&](const fs::path& last) { return was_interrupted && DoesLogFollow(target, last); });
  if (!kept) {
    return kept.error();
  }
  restored.kept = std::move(kept->database);
  restored.left = std::move(kept->left);
  return PublishCopy(target);
}

Status CopyAndReplace(const RestoreOrder& order, RestoredAtlas& restored) {
  const Result<DataDirectory> directory = DataDirectory::Lock(FolderOf(order.target));
  if (!directory) {
    return directory.error();
  }
  ATLAS_RETURN_IF_ERROR(CheckTarget(order));  // nobody else can change it any more
  const fs::path target = directory->database_file();
  const bool was_there = directory->has_atlas();
  std::error_code unknown;
  const bool was_interrupted = !was_there && fs::exists(directory->restored_file(), unknown);
  Status status;
  try {
    status = MakeCopy(order, target, restored);
  } catch (const std::exception& error) {
    status = StatusFromException(error);
  }
  const bool is_made = status.ok();
  if (is_made) {
    status = Replace(target, was_interrupted, restored);
  }
  // Where the atlas has another name, now or since an earlier restore, the copy tells the daemon
  // so.
  const bool has_other_name = was_interrupted || (is_made && was_there);
  if (!status.ok() && (directory->has_atlas() || !has_other_name)) {
    RemovePartial(target);
  }
  return status;
}

Status Restore(const RestoreOrder& order, RestoredAtlas& restored) {
  const Result<DatabaseFiles> files = FindBackup(order.backup);
  if (!files) {
    return files.error();
  }
  ATLAS_RETURN_IF_ERROR(CheckTarget(order));
  ATLAS_RETURN_IF_ERROR(CheckIdle(FolderOf(order.target)));
  const Result<AtlasFacts> backup = ReadAtlasBack(files->database, order.work);
  if (!backup) {
    return backup.error().WithContext(order.backup.string());
  }
  restored.backup = *backup;
  return CopyAndReplace(order, restored);
}

}  // namespace

Result<RestoredAtlas> RestoreAtlas(const RestoreOrder& order) {
  RestoredAtlas restored;
  const Status status = Restore(order, restored);
  return status.ok() ? Result<RestoredAtlas>(restored) : Error(status.WithContext("restore"));
}

}  // namespace atlas
