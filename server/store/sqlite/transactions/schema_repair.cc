#include "server/store/sqlite/transactions/schema_repair.h"

#include <exception>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/schema_check.h"
#include "server/store/sqlite/transactions/counter_check.h"

namespace atlas {
namespace {

bool IsOfAVersionThatIsRead(Connection& connection) {
  const Result<std::int64_t> version = ReadSchemaVersion(connection);
  return version && *version >= kFirstReadableVersion;
}

// Where a page of a table became another one's, too, to write would be to destroy.
Status PutBackAndCheck(Connection& connection, std::string& damages) {
  try {
    damages = PutSchemaBack(connection);
    return CheckCounters(connection);
  } catch (const std::exception& error) {
    Status status = StatusFromException(error);
    if (status.code() != StatusCode::kInvalidData) {
      throw;
    }
    return status;
  }
}

}  // namespace

Result<std::string> RepairSchema(Connection& connection,
                                 const std::function<void()>& before_writing) {
  std::string damages;
  if (!IsOfAVersionThatIsRead(connection)) {
    connection.TakeWholeSchemasOnly();
    return damages;
  }
  const SchemaDamage damage = FindSchemaDamage(connection);
  if (damage.is_none()) {
    connection.TakeWholeSchemasOnly();
    return damages;
  }
  Status left(StatusCode::kInvalidData, "nothing tells what it was");
  const char* unchanged = "nothing was changed";
  if (damage.can_be_put_back) {
    connection.Begin();
    left = PutBackAndCheck(connection, damages);
    if (left.ok() && before_writing) {
      connection.RollBack();
      connection.Execute("PRAGMA writable_schema = ON");  // as it was opened
      before_writing();
      unchanged = "nothing that was committed was changed";
      connection.Begin();
      left = PutBackAndCheck(connection, damages);
    }
    if (left.ok()) {
      connection.Commit();
      return damages;
    }
    connection.RollBack();
  }
  return Error(StatusCode::kInvalidData,
               StrCat("store: the database is damaged: ", damage.what, " and cannot be put right (",
                      left.message(), "): ", unchanged, "; restore a backup"));
}

}  // namespace atlas
