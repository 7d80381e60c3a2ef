#include "server/store/sqlite/atlas_opening.h"

#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/log_renewal.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/damaged_log.h"
#include "server/store/sqlite/log_origin.h"
#include "server/store/sqlite/lost_commits.h"
#include "server/store/sqlite/migrations/migration.h"
#include "server/store/sqlite/revision_note.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/stored_bytes.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/transactions/atlas_past.h"
#include "server/store/sqlite/transactions/counter_check.h"
#include "server/store/sqlite/transactions/page_owners.h"
#include "server/store/sqlite/transactions/schema_repair.h"
#include "server/store/sqlite/transactions/transactions.h"

namespace atlas {
namespace {

constexpr const char* kNothingChanged = "nothing was changed";

DatabaseOptions WriterOptions(const SqliteStoreOptions& options, std::filesystem::path file) {
  return {std::move(file), DatabaseOptions::Mode::kReadWrite, options.writer_cache_kib, 5'000,
          true};
}

std::filesystem::path LogOf(const DataDirectory& directory) {
  return directory.database_file().string() + "-wal";
}

bool HasLog(const DataDirectory& directory) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(LogOf(directory), error);
  return !error && bytes > 0;
}

// SQLite would take it for the new atlas's own.
Status RefuseLogOfAnother(const DataDirectory& directory) {
  if (!HasLog(directory)) {
    return {};
  }
  return {StatusCode::kConflict,
          StrCat(LogOf(directory).string(),
                 " is the log of an atlas that is not there: put atlas.db back beside it, or move "
                 "the log away to begin a new atlas")};
}

// A new atlas in its place would tell vehicles that what they hold is of nobody.
Status RefusePlaceOfAnother(const DataDirectory& directory) {
  const std::filesystem::path note = NoteOf(directory.database_file());
  const auto noted = ReadRevisionNote(note);
  if (!noted) {
    return {};
  }
  return {
      StatusCode::kConflict,
      StrCat(note.string(), " is of an atlas at revision ", noted->revision,
             " that is not there: put atlas.db back beside it, or restore a backup; or move the "
             "note away to begin a new atlas")};
}

Status CreateAtlas(const DataDirectory& directory, const SqliteStoreOptions& options) {
  if (!options.new_profile) {
    return Status(StatusCode::kNotFound,
                  StrCat("there is no atlas in ", options.directory.string()));
  }
  ATLAS_RETURN_IF_ERROR(RefuseLogOfAnother(directory));
  ATLAS_RETURN_IF_ERROR(RefusePlaceOfAnother(directory));
  ATLAS_RETURN_IF_ERROR(options.new_profile->Validate());
  directory.RemoveUnfinished();
  try {
    Connection connection(
        {directory.unfinished_file(), DatabaseOptions::Mode::kCreate, 2'000, 5'000});
    CreateSchema(connection, {*options.new_profile, options.new_atlas_id, 1});
  } catch (const std::exception& error) {
    directory.RemoveUnfinished();
    return StatusFromException(error).WithContext("creating an atlas");
  }
  return directory.Publish();
}

// What an interrupted restore left. An empty atlas must not take the place of one that waits under
// another name.
Status SettleRestore(const DataDirectory& directory) {
  std::error_code error;
  if (!std::filesystem::exists(directory.restored_file(), error)) {
    return {};
  }
  if (!directory.has_atlas()) {
    return {
        StatusCode::kConflict,
        StrCat("a restore was interrupted in ", directory.database_file().parent_path().string(),
               ": restore the backup again, or give the atlas that was there its name back")};
  }
  std::filesystem::remove(directory.restored_file(), error);  // it takes room, and nothing else
  return {};
}

Status FindOrCreateAtlas(const DataDirectory& directory, const SqliteStoreOptions& options) {
  ATLAS_RETURN_IF_ERROR(SettleRestore(directory));
  return directory.has_atlas() ? Status() : CreateAtlas(directory, options);
}

// What can wait does on a full disk: all that is stored can be read there.
void WhereThereIsRoom(const std::function<void()>& write) {
  try {
    write();
  } catch (const std::exception& error) {
    if (StatusFromException(error).code() != StatusCode::kResourceExhausted) {
      throw;
    }
  }
}

// Before anything is read of it, or written. What was copied of lost commits may be longer than
// what is left.
Status CheckFiles(Connection& writer, const DamagedLog& log, const LogOrigin& origin) {
  Status status = origin.Check(writer, log.is_lossy());
  if (status.ok()) {
    status = log.is_lossy() ? CheckWhatIsLeft(writer, LossOf(log), kNothingChanged)
                            : CheckEnd(writer, origin.database());
  }
  if (!status.ok() && log.damage.turned.empty() && !log.kept.empty()) {
    std::error_code ignored;
    std::filesystem::remove(log.kept, ignored);  // the log is what it was
  }
  return status;
}

// Of bits that were turned back.
std::string NoteMended(Connection& writer, const DamagedLog& log) {
  std::string what =
      StrCat("the log was damaged at frame ", log.damage.frame, ": ", log.damage.turned.size(),
             " bits were turned back, nothing is lost by them; a copy of the "
             "log as it was is ",
             log.kept.filename().string());
  writer.Begin();
  AddEvent(writer, {EventKind::kTablesRepaired, kAtlasItself, log.kept.filename().string(), what});
  writer.Commit();
  return what;
}

// By the events that are behind.
std::vector<std::string> ListMended(Connection& writer, std::int64_t last_event) {
  std::vector<std::string> mended;
  ScanEvents(writer, [&](const Event& event) {
    const bool is_new = static_cast<std::int64_t>(event.id) > last_event;
    if (is_new && !event.is_damaged && event.kind != EventKind::kUpgraded) {
      mended.push_back(StrCat(EventName(event.kind), ": ", event.subject,
                              event.subject.empty() ? "" : ": ", event.detail));
    }
  });
  return mended;
}

// What every write counts on. A lost mark is a tile that is wrong for ever: what is not sure is
// marked again. What there was, with what was put right of the schema, for people.
std::vector<std::string> Mend(Connection& writer, std::uint8_t levels, const std::string& schema) {
  writer.Begin();
  const std::int64_t last_event = writer.Ask("SELECT coalesce(max(id), 0) FROM events");
  if (!schema.empty()) {
    AddEvent(writer, {EventKind::kTablesRepaired, kAtlasItself, "schema",
                      StrCat(schema, ": it was put back")});
  }
  RestoreCounters(writer);
  FinishMigration(writer);
  std::vector<SessionRow> sessions;
  for (const std::int64_t session : ListDamagedSessions(writer)) {
    if (auto row = TellSession(writer, session, Vouching::kByChecksum)) {
      sessions.push_back(*std::move(row));
      AddEvent(writer, {EventKind::kTablesRepaired, kAtlasItself,
                        StrCat("session number ", session), "its row was damaged"});
    }  // who needs one that cannot be told, is told so
  }
  {
    const ToleratedIndexes tolerated(writer);
    PutBackSessions(writer, sessions);
  }
  if (const Status status = CheckMarks(writer); !status.ok()) {
    MarkAllInStore(writer, status.message(), levels);
  }
  writer.Commit();
  return ListMended(writer, last_event);
}

// Why there is no atlas to be served. A daemon that was killed while its log was copied leaves a
// database that is none without it.
Status Refusal(const DataDirectory& directory, const Status& status, bool has_note_alone) {
  const char* advice = "";
  if (status.code() == StatusCode::kResourceExhausted) {
    advice = "; this is written before the atlas is served: make room on its disk";
  } else if (status.code() == StatusCode::kInvalidData && has_note_alone) {
    advice = "; there is no log (atlas.db-wal): if it was moved away after a kill, put it back";
  }
  return Status(status.code(), status.message() + advice)
      .WithContext(directory.database_file().string());
}

// What was never acknowledged goes before anything is written, and stays with a start that is
// refused.
void DropUnfinished(Connection& writer, const DamagedLog& log, const LogOrigin& origin) {
  if (log.damage.has_rest && !log.is_lossy()) {
    WhereThereIsRoom([&] { DropRest(writer, origin.log_file()); });
  }
}

struct Readable {
  std::string schema;  // what was put right of it, for people
  const char* changed = kNothingChanged;
};

// Nothing is read by a schema that is damaged.
Result<Readable> MakeReadable(Connection& writer,
                              const DamagedLog& log,
                              const LogOrigin& origin,
                              const SqliteStoreOptions& options) {
  if (Status status = CheckFiles(writer, log, origin); !status.ok()) {
    return Error(std::move(status));
  }
  const bool has_rest = log.damage.has_rest && !log.is_lossy();
  const std::function<void()> drop = [&] {
    DropUnfinished(writer, log, origin);
  };
  Result<std::string> schema = RepairSchema(writer, has_rest ? drop : nullptr);
  if (!schema) {
    return Error(schema.error());
  }
  Readable readable{*schema};  // which is put back only where what is left is an atlas
  Status status = MigrateStore(writer, [&](std::int64_t from) {
    if (from < kFirstReadableVersion) {  // the others are written later
      drop();
      readable.changed = "nothing but what an upgrade changes was changed";
    }
    if (options.on_upgrade) {
      options.on_upgrade(from);
    }
  });
  if (status.ok()) {
    status = CheckPagesAreTheirs(writer);
  }
  return status.ok() ? Result<Readable>(std::move(readable)) : Error(std::move(status));
}

void BeginWriting(Connection& writer, const DamagedLog& log, const LogOrigin& origin) {
  DropUnfinished(writer, log, origin);
  writer.Execute("PRAGMA journal_mode = WAL");
  KeepTableSums(writer);
  MarkAtTheEnd(writer);
}

void Tell(const std::function<void(const std::string&)>& whom, const std::string& what) {
  if (whom) {
    whom(what);
  }
}

}  // namespace

Result<OpenedAtlas> OpenAtlas(const DataDirectory& directory, const SqliteStoreOptions& options) {
  if (Status status = FindOrCreateAtlas(directory, options); !status.ok()) {
    return Error(std::move(status));
  }
  if (std::error_code ignored; std::filesystem::is_directory(directory.database_file(), ignored)) {
    return Error(StatusCode::kPermissionDenied,
                 StrCat(directory.database_file().string(), ": is a folder, not a database"));
  }
  const Result<DamagedLog> log = MendLog(LogOf(directory));
  if (!log) {
    return Error(log.error());
  }
  if (Status status = RenewLog(directory.database_file()); !status.ok()) {
    return Error(status.WithContext(directory.database_file().string()));
  }
  const std::optional<NotedRevision> noted = ReadRevisionNote(NoteOf(directory.database_file()));
  const bool has_note_alone = noted && !HasLog(directory);
  try {
    const LogOrigin origin(directory.database_file(), noted);
    auto writer = std::make_unique<Connection>(WriterOptions(options, directory.database_file()));
    writer->KeepLog(origin.has_log());  // whoever refuses leaves all as it was
    AddRowHash(*writer);
    const Result<Readable> readable = MakeReadable(*writer, *log, origin, options);
    if (!readable) {
      return Error(Refusal(directory, readable.error(), has_note_alone));
    }
    auto identity = ReadMeta(*writer);
    if (!identity) {
      return Error(identity.error().WithContext(directory.database_file().string()));
    }
    const Result<std::string> loss = FindLoss(*writer, *identity, *log, noted, readable->changed);
    if (!loss) {
      return Error(Refusal(directory, loss.error(), has_note_alone));
    }
    BeginWriting(*writer, *log, origin);
    if (!loss->empty()) {  // before a revision is given again
      Tell(options.on_damaged_log, NoteLoss(*writer, *identity, *loss, log->kept, noted));
    }
    if (log->is_lossy()) {  // not before it is noted: a kill in between is told twice
      WhereThereIsRoom([&] { DropRest(*writer, origin.log_file()); });
    }
    WhereThereIsRoom([&] { DropAllLeases(*writer); });
    for (const std::string& what : Mend(*writer, identity->profile.levels, readable->schema)) {
      Tell(options.on_repair, what);
    }
    if (!log->damage.turned.empty()) {
      Tell(options.on_damaged_log, NoteMended(*writer, *log));
    }
    KeepVehicleBytes(*writer);
    AtlasPast past = ReadPast(*writer);
    identity->lost = std::move(past.lost);
    writer->KeepLog(false);
    return OpenedAtlas{std::move(*identity), std::move(writer), past.may_have_purged, origin.log(),
                       origin.revision_alone()};
  } catch (const std::exception& error) {
    return Error(Refusal(directory, StatusFromException(error), has_note_alone));
  }
}

}  // namespace atlas
