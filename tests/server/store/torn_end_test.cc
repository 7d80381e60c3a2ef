// What a kill left at the end of a log: it goes before a start writes anything, and stays where the
// start is refused.
#include <algorithm>
#include <fstream>
#include <functional>
#include <iterator>
#include <string_view>
#include <utility>

#include <gmock/gmock.h>

#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/log_damage.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/transactions/schema_repair.h"
#include "tests/server/store/schema_fixture.h"

namespace atlas {
namespace {

using ::testing::HasSubstr;

constexpr const char* kSpoilSchema =
    "sql = replace(sql, 'epoch INTEGER', 'fpoch INTEGER') WHERE name = 'meta'";

// Tells whenever a transaction is about to be committed, on the thread that does. For connections
// that are opened while it is there, and closed before it goes; one at a time.
class Commits {
 public:
  explicit Commits(std::function<void()> on_commit) {
    told = std::move(on_commit);
    sqlite3_auto_extension(reinterpret_cast<void (*)()>(&Watch));
  }
  Commits(const Commits&) = delete;
  Commits& operator=(const Commits&) = delete;
  ~Commits() { sqlite3_cancel_auto_extension(reinterpret_cast<void (*)()>(&Watch)); }

 private:
  static int Watch(sqlite3* db, const char**, const struct sqlite3_api_routines*) {
    return sqlite3_trace_v2(db, SQLITE_TRACE_STMT, &OnStatement, nullptr);
  }
  static int OnStatement(unsigned, void*, void*, void* sql) {
    if (std::string_view(static_cast<const char*>(sql)).starts_with("COMMIT")) {
      told();
    }
    return 0;
  }
  static inline std::function<void()> told;
};

class TornEndTest : public SchemaTest {
 protected:
  TornEndTest() {
    options_.on_repair = [this](const std::string& what) {
      told_ += what;
    };
  }

  std::filesystem::path Log() const { return Database().string() + "-wal"; }
  static std::string BytesOf(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // As a kill does while a commit is written. Nobody has the database open.
  void Tear() {
    {
      Connection connection({Database(), DatabaseOptions::Mode::kReadWrite, 1'024, 0, true});
      connection.KeepLog(true);
      const std::string version =
          "PRAGMA user_version = " + std::to_string(connection.Ask("PRAGMA user_version"));
      connection.Execute(version.c_str());
      connection.Execute(version.c_str());
    }
    std::string torn = BytesOf(Log());
    std::fill(torn.end() - 100, torn.end(), 'Z');
    std::ofstream(Log(), std::ios::binary) << torn;
    ASSERT_TRUE(HasRest());
  }
  bool HasRest() const { return FindLogDamage(Log(), true)->has_rest; }
  void ExpectGoneBeforeTheFirstCommit() {
    Tear();
    int commits = 0;
    const Commits watch([&] {
      EXPECT_FALSE(HasRest()) << "behind commit " << commits;
      ++commits;
    });
    Open();
    EXPECT_GT(commits, 0);
    store_.reset();
  }

  std::string told_;
};

TEST_F(TornEndTest, GoesBeforeAnythingIsWritten) {
  Fill(4);
  store_.reset();
  ExpectGoneBeforeTheFirstCommit();
}

TEST_F(TornEndTest, GoesBeforeTheSchemaIsPutBack) {
  Fill(4);
  store_.reset();
  Spoil(Database(), kSpoilSchema);
  ExpectGoneBeforeTheFirstCommit();
  EXPECT_THAT(told_, HasSubstr("table meta"));
  Open();
  EXPECT_TRUE(CheckAll().ok()) << CheckAll().message();
}

TEST_F(TornEndTest, GoesBeforeAnUpgrade) {
  for (const testing::EarlierStore& store : testing::kEarlierStores) {
    SCOPED_TRACE(store);
    std::filesystem::remove_all(options_.directory);
    testing::MakeEarlierStore(store, Database());
    ExpectGoneBeforeTheFirstCommit();
  }
}

TEST_F(TornEndTest, StaysBesideWhatCannotBePutRight) {
  Fill(4);
  store_.reset();
  Tamper("DELETE FROM poses");
  Spoil(Database(), kSpoilSchema);
  Tear();
  const std::string database = BytesOf(Database());
  const std::string log = BytesOf(Log());
  const auto refused = OpenSqliteStore(options_);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("nothing was changed"));
  EXPECT_EQ(BytesOf(Database()), database);
  EXPECT_EQ(BytesOf(Log()), log);
}

// It is gone then, which is not nothing.
TEST_F(TornEndTest, AnUpgradeThatIsRefusedBehindItSaysWhatIsTrue) {
  testing::MakeEarlierStore({"store_v4", 4}, Database());
  Spoil(Database(), "sql = replace(sql, 'z_um INTEGER', 'z_um INTEGES') WHERE name = 'poses'");
  const auto rows = testing::DumpStore(Database());
  Tear();
  const auto refused = OpenSqliteStore(options_);
  ASSERT_FALSE(refused);
  EXPECT_FALSE(HasRest());
  EXPECT_THAT(refused.error().message(), HasSubstr("nothing that was committed was changed"));
  EXPECT_EQ(testing::DumpStore(Database()), rows);
}

TEST_F(TornEndTest, SoDoesARepairOfTheSchema) {
  Fill(4);
  store_.reset();
  Spoil(Database(), kSpoilSchema);
  Connection connection({Database(), DatabaseOptions::Mode::kReadWrite, 1'024, 0, true});
  AddRowHash(connection);
  const auto refused = RepairSchema(connection, [&] { Tamper("DELETE FROM poses"); });
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("nothing that was committed was changed"));
}

}  // namespace
}  // namespace atlas
