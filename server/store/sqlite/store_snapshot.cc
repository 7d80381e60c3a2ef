#include "server/store/sqlite/store_snapshot.h"

#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/tile_table.h"
#include "server/store/sqlite/transactions/keyframe_contents.h"
#include "server/store/sqlite/transactions/session_changes.h"

namespace atlas {
namespace {

constexpr int kCache_kib = 8 * 1024;
constexpr int kBusyTimeout_ms = 5'000;  // while another process reads a log that a crash left

// A file that is alone is read as it lies there. Else the log is part of the atlas, and reading it
// takes SQLite's locks.
DatabaseOptions::Mode ModeFor(const DatabaseFiles& files) {
  return files.is_alone() ? DatabaseOptions::Mode::kUntouched : DatabaseOptions::Mode::kReadOnly;
}

// Nothing of this program's making is wrong with a file that lacks a table.
Status ReadFailure(const std::exception& error) {
  Status status = StatusFromException(error);
  return status.code() == StatusCode::kInternal ? Status(StatusCode::kInvalidData, status.message())
                                                : status;
}

std::string AdviceFor(StatusCode code, const DatabaseFiles& files) {
  if (code == StatusCode::kPermissionDenied && !files.is_alone()) {
    return StrCat("; it has a log beside it, which takes ", files.database.string(),
                  "-shm to read: make the folder writable, or copy the files that begin with its "
                  "name to one that is");
  }
  return {};
}

}  // namespace

StoreSnapshot::StoreSnapshot(DatabaseFiles files) : files_(std::move(files)) {}
StoreSnapshot::StoreSnapshot(StoreSnapshot&&) noexcept = default;
StoreSnapshot& StoreSnapshot::operator=(StoreSnapshot&& other) noexcept {
  snapshot_.reset();
  files_ = std::move(other.files_);
  connection_ = std::move(other.connection_);
  snapshot_ = std::move(other.snapshot_);
  identity_ = other.identity_;
  state_ = other.state_;
  return *this;
}
StoreSnapshot::~StoreSnapshot() = default;

Result<StoreSnapshot> StoreSnapshot::Open(const std::filesystem::path& file) {
  Result<DatabaseFiles> files = DatabaseFiles::Look(file);
  if (!files) {
    return Error(files.error());
  }
  StoreSnapshot snapshot(*std::move(files));
  Status status = snapshot.Begin();
  // Whoever wrote meanwhile explains what looks like damage.
  if (Status untouched = snapshot.CheckUntouched(); !untouched.ok()) {
    return Error(std::move(untouched));
  }
  if (!status.ok()) {
    return Error(snapshot.Explained(std::move(status)));
  }
  return snapshot;
}

// Opens the database; what is read first tells the transaction which state it is of.
Status StoreSnapshot::Begin() {
  try {
    connection_ = std::make_unique<Connection>(
        DatabaseOptions{files_.database, ModeFor(files_), kCache_kib, kBusyTimeout_ms, true});
    snapshot_ = std::make_unique<Snapshot>(*connection_);
    const Result<StoreIdentity> identity = ReadIdentity(*connection_);
    if (!identity) {
      return identity.error();
    }
    identity_ = *identity;
    state_ = ReadDirty(*connection_);
    return {};
  } catch (const std::exception& error) {
    return ReadFailure(error);
  }
}

// Without locks nobody keeps a daemon from beginning to write: what was read then is not believed.
Status StoreSnapshot::CheckUntouched() const {
  if (!files_.is_alone()) {
    return {};
  }
  const Result<DatabaseFiles> now = files_.LookAgain();
  return now && *now == files_
             ? Status()
             : Status(StatusCode::kUnavailable,
                      StrCat("atlas file ", files_.database.string(),
                             ": somebody began to write to it meanwhile; try again"));
}

Status StoreSnapshot::Explained(const Status& status) const {
  const std::string advice = AdviceFor(status.code(), files_);
  return Status(status.code(), status.message() + advice)
      .WithContext(StrCat("atlas file ", files_.database.string()));
}

template <typename T, typename Reading>
Result<T> StoreSnapshot::Read(const Reading& read) {
  Result<T> found = T();
  try {
    found = read(*connection_);
  } catch (const std::exception& error) {
    found = Error(ReadFailure(error));
  }
  if (Status untouched = CheckUntouched(); !untouched.ok()) {
    return Error(std::move(untouched));
  }
  return found ? std::move(found) : Error(Explained(found.error()));
}

Result<std::optional<StoredTile>> StoreSnapshot::ReadTile(const TileId& id) {
  return Read<std::optional<StoredTile>>(
      [&id](Connection& connection) { return ReadTileRow(connection, id); });
}

Result<SessionPage> StoreSnapshot::ListSessions(const SessionKey& after, std::uint32_t limit) {
  return Read<SessionPage>(
      [&](Connection& connection) { return ReadChangedSessions(connection, after, limit); });
}

Result<KeyframeContents> StoreSnapshot::ReadKeyframes(const SessionKey& session,
                                                      std::optional<std::uint32_t> after_sequence,
                                                      std::size_t max_bytes) {
  return Read<KeyframeContents>([&](Connection& connection) {
    return ReadKeyframeContents(connection, session, after_sequence, max_bytes);
  });
}

Status StoreSnapshot::ScanTiles(const TileRect& rect,
                                const std::function<Status(const TileSummary&)>& visit) {
  Status visited;
  try {
    ScanTileRows(*connection_, rect, [&](const TileSummary& tile) {
      if (visited.ok()) {
        visited = visit(tile);
      }
    });
  } catch (const std::exception& error) {
    ATLAS_RETURN_IF_ERROR(CheckUntouched());
    return Explained(ReadFailure(error));
  }
  ATLAS_RETURN_IF_ERROR(CheckUntouched());
  return visited;
}

}  // namespace atlas
