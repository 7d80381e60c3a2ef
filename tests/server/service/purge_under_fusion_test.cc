// A keyframe that is purged while a worker builds a tile of it: between the moment in which the
// worker learns what the tile is made of and the one in which it reads it.
#include <atomic>

#include "tests/server/service/blob_reads.h"
#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

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
