// What the workers do when the store takes no writes, and when it takes them again.
#include <future>

#include <sqlite3.h>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

class FullDiskTest : public ServiceTest {
 protected:
  // The store stays open: what is done to it takes effect with the next write.
  void Execute(const char* sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((directory_ / "data" / "atlas.db").c_str(), &db), SQLITE_OK);
    sqlite3_busy_timeout(db, 10'000);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }
  // Tiles may be claimed; nothing that they end with is written.
  void Fill() {
    Execute(
        "CREATE TRIGGER no_tile BEFORE INSERT ON tiles BEGIN SELECT raise(ABORT, 'full'); END;"
        "CREATE TRIGGER no_release BEFORE UPDATE ON dirty_tiles WHEN new.lease_owner IS NULL "
        "BEGIN SELECT raise(ABORT, 'full'); END");
  }
  void MakeRoom() { Execute("DROP TRIGGER no_tile; DROP TRIGGER no_release"); }
};

// The clock stands still, so that no lease ever runs out.
TEST_F(FullDiskTest, AClaimThatCouldNotBeReleasedIsReleasedWhenThereIsRoom) {
  Open(1);  // notes by which rules is fused
  Open(0);
  UploadDrive(4);
  Fill();
  std::promise<void> refused;
  std::atomic<int> told = 0;
  ServiceOptions options;
  options.fusion.min_backoff_ms = 0;
  service_ = std::make_unique<AtlasService>(
      *store_, [] { return kTestNow_ms; },
      [&, tries = 0](LogLevel level, const std::string& message) mutable {
        Note(message);
        if (message.find("cannot release tile") != std::string::npos) {
          told += level == LogLevel::kDebug ? 0 : 1;
          if (++tries == 3) {
            refused.set_value();
          }
        }
      },
      options);
  ASSERT_EQ(refused.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  MakeRoom();
  const auto wait = service_->WaitUntilClean(Long());
  ASSERT_TRUE(wait.has_value()) << wait.error().message();
  EXPECT_FALSE(wait->is_timed_out);
  EXPECT_EQ(wait->dirty_tiles, 0u);
  EXPECT_EQ(told, 1) << "it is tried every second";
  service_.reset();
  EXPECT_NE(Log().find("fusion: tiles can be released again, after "), std::string::npos) << Log();
}

}  // namespace
}  // namespace atlas
