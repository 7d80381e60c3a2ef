// A keyframe that is purged while a worker builds a tile of it: between the moment in which the
// worker learns what the tile is made of and the one in which it reads it.
#include <atomic>
#include <functional>

#include <sqlite3.h>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

// Tells whenever the blob of a keyframe is about to be read, on the thread that reads it. For
// connections that are opened while it is there; one at a time.
class BlobReads {
 public:
  explicit BlobReads(std::function<void()> on_read) {
    told = std::move(on_read);
    sqlite3_auto_extension(reinterpret_cast<void (*)()>(&Watch));
  }
  BlobReads(const BlobReads&) = delete;
  BlobReads& operator=(const BlobReads&) = delete;
  ~BlobReads() { sqlite3_cancel_auto_extension(reinterpret_cast<void (*)()>(&Watch)); }

 private:
  static int Watch(sqlite3* db, const char**, const struct sqlite3_api_routines*) {
    return sqlite3_trace_v2(db, SQLITE_TRACE_STMT, &OnStatement, nullptr);
  }
  static int OnStatement(unsigned, void*, void*, void* sql) {
    if (std::string_view(static_cast<const char*>(sql)).starts_with("SELECT blob FROM keyframes")) {
      told();
    }
    return 0;
  }
  static inline std::function<void()> told;
};

class PurgeUnderFusionTest : public ServiceTest {};

TEST_F(PurgeUnderFusionTest, IsNoDamage) {
  Open(1, "reference");
  UploadDrive(5);
  const AtlasDigest day = Digest();
  std::atomic<int> purges = 0;  // with the first keyframe of the day, which comes before the night
  const BlobReads reads([&] {
    if (purges.fetch_add(1) == 0) {
      const auto purged = Await<SessionChangeResult>([&](auto done) {
        store_->ChangeSession({{"bus", "night"}, SessionAction::kPurge, "tester", ""},
                              std::move(done));
      });
      EXPECT_TRUE(purged) << purged.error().message();
    }
  });
  Open(0);
  UploadDrive(5);
  for (std::uint32_t i = 0; i < 5; ++i) {
    ASSERT_TRUE(Upload(DriveUpload(i, "night")));
  }
  EXPECT_EQ(purges, 0);
  Open(1);
  EXPECT_EQ(Digest().sha256, day.sha256);
  EXPECT_GT(purges, 0);
  EXPECT_EQ(service_->FindSession({"bus", "night"}).value()->keyframes, 0U);
  EXPECT_EQ(service_->ReadStatus()->damaged_tiles, 0U);
  EXPECT_EQ(Log().find("stays dirty"), std::string::npos) << Log();
}

}  // namespace
}  // namespace atlas
