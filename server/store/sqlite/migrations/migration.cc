#include "server/store/sqlite/migrations/migration.h"

#include <exception>
#include <string>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/migrations/from_version_1.h"
#include "server/store/sqlite/migrations/from_version_2.h"
#include "server/store/sqlite/migrations/from_version_3.h"
#include "server/store/sqlite/migrations/from_version_4.h"
#include "server/store/sqlite/migrations/from_version_5.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/schema_check.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/event_table.h"

namespace atlas {
namespace {

// Indexes are sorted for on disk: memory does not grow with the atlas.
constexpr const char* kSortOnDisk = "PRAGMA temp_store = FILE";
constexpr const char* kSortInMemory = "PRAGMA temp_store = MEMORY";

// What was noticed on the way, for people; empty: nothing.
std::string RunSteps(Connection& connection, std::int64_t from, const MapProfile& profile) {
  if (from < 2) {
    MigrateFromVersion1(connection, profile);
  }
  if (from < 3) {
    MigrateFromVersion2(connection);
  }
  if (from < 4) {
    MigrateFromVersion3(connection);
  }
  std::string noticed = MigrateFromVersion4(connection);
  MigrateFromVersion5(connection);
  return noticed;
}

void AddUpgradeEvent(Connection& connection, std::int64_t from, const std::string& noticed) {
  AddEvent(connection, {EventKind::kUpgraded, kAtlasItself, StrCat("version ", kStoreSchemaVersion),
                        StrCat("from version ", from, noticed)});
}

void WriteVersion(Connection& connection) {
  connection.Execute(StrCat("PRAGMA user_version = ", kStoreSchemaVersion).c_str());
}

Status RunInOneTransaction(Connection& connection, std::int64_t from, const MapProfile& profile) {
  connection.Begin();
  AddUpgradeEvent(connection, from, RunSteps(connection, from, profile));
  WriteTableSums(connection);
  WriteVersion(connection);
  if (const SchemaDamage damage = FindSchemaDamage(connection); !damage.is_none()) {
    return {StatusCode::kInvalidData,
            StrCat("upgrading it from schema version ", from, ": ", damage.what,
                   "; nothing that was committed was changed; put a copy of the data directory "
                   "back")};
  }
  connection.Commit();
  return {};
}

// Nothing of this program's making is wrong with a file that lacks a table, or has one too many.
Status Failure(const std::exception& error, std::int64_t from) {
  const Status status = StatusFromException(error);
  const StatusCode code =
      status.code() == StatusCode::kInternal ? StatusCode::kInvalidData : status.code();
  return Status(code, status.message())
      .WithContext(StrCat("upgrading it from schema version ", from));
}

}  // namespace

Status MigrateStore(Connection& connection, const std::function<void(std::int64_t)>& on_begin) {
  const Result<std::int64_t> from = ReadSchemaVersion(connection);
  if (!from) {
    return from.error();
  }
  if (*from == kStoreSchemaVersion) {
    return {};
  }
  const Result<StoreIdentity> identity = ReadMeta(connection);
  if (!identity) {
    return identity.error();
  }
  if (on_begin) {
    on_begin(*from);
  }
  if (*from >= kFirstReadableVersion) {
    return {};
  }
  try {
    connection.Execute(kSortOnDisk);
    ATLAS_RETURN_IF_ERROR(RunInOneTransaction(connection, *from, identity->profile));
    connection.Execute(kSortInMemory);
    return {};
  } catch (const std::exception& error) {
    return Failure(error, *from);
  }
}

void FinishMigration(Connection& connection) {
  const std::int64_t from = ReadSchemaVersion(connection).value();  // MigrateStore() read it
  if (from != kStoreSchemaVersion) {
    MigrateFromVersion5(connection);
    AddUpgradeEvent(connection, from, "");
    WriteVersion(connection);
  }
}

}  // namespace atlas
