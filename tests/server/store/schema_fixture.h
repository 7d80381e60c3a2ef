// Atlases whose schema says something else than it did, as a disk would have it: SQLite is not
// told.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/server/store/backup_fixture.h"
#include "tests/server/store/earlier_stores.h"

namespace atlas {

class SchemaTest : public BackupTest {
 protected:
  // `how` says what of the rows of sqlite_schema becomes what.
  static void Spoil(const std::filesystem::path& database, const std::string& how) {
    testing::OpenDatabase(database).Execute(
        "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET " + how);
  }
  // The texts of the atlas, which nobody has open.
  std::vector<std::string> Texts() const {
    testing::OpenDatabase database(Database());
    database.Execute("PRAGMA writable_schema = ON");  // where it is damaged, too
    return database.Select("SELECT type, name, tbl_name, sql FROM sqlite_schema ORDER BY rowid");
  }
  void CopyToBackup() const {
    std::filesystem::copy_file(Database(), backup(),
                               std::filesystem::copy_options::overwrite_existing);
  }
  // Damage that was put right by the last opening.
  std::vector<Event> Repairs() {
    std::vector<Event> repairs;
    const auto events = store_->ListEvents(0, 1'000);
    EXPECT_TRUE(events) << events.error().message();
    for (const Event& event : *events) {
      if (event.kind == EventKind::kTablesRepaired) {
        repairs.push_back(event);
      }
    }
    return repairs;
  }
  Status CheckAll() {
    for (const Status& status :
         {store_->CheckCounters(), store_->CheckIndexes([] { return Status(); }),
          store_->CheckCompactions(), store_->CheckSession({"bus", "day"})}) {
      if (!status.ok()) {
        return status;
      }
    }
    return {};
  }
};

}  // namespace atlas
