// An atlas of version 1 of the store (tests/golden/store_v1.sql), read as of the time before it was
// migrated: what its keyframes make at their poses of then.
#include <fstream>
#include <iterator>

#include <sqlite3.h>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

class MigratedAtlasTest : public ServiceTest {
 protected:
  void OpenGolden() {
    Close();
    std::ifstream in(std::string(ATLAS_GOLDEN_DIR) + "/store_v1.sql");
    const std::string sql{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    std::filesystem::create_directories(directory_ / "golden");
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((directory_ / "golden/atlas.db").c_str(), &db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(db);
    Open(2, "golden");
  }
  // Keyframe `id` of the golden atlas at another pose, which was its first.
  UploadRequest FirstUpload(std::int64_t id, const testing::MapPose& pose) {
    const KeyframeRecord record = store_->ReadKeyframe(id).value();
    return {record.key, record.time_ms, PoseOf(pose), std::nullopt,
            store_->ReadKeyframeBlob(id).value()};
  }
};

TEST_F(MigratedAtlasTest, ThePastIsWhatItsKeyframesMade) {
  OpenGolden();
  const AtlasDigest at_27 = DigestAt(27);  // three uploads, nothing moved yet
  EXPECT_EQ(DigestAt(109).sha256, Digest().sha256);
  const std::vector<UploadRequest> uploads = {FirstUpload(1, {0.0, 0.0, 1.8, 0.0}),
                                              FirstUpload(2, {1.5, 0.2, 1.8, 10.0}),
                                              FirstUpload(3, {0.4, 0.1, 1.8, 0.0})};
  Open(2, "fresh");
  for (const UploadRequest& upload : uploads) {
    ASSERT_TRUE(Upload(upload).has_value());
  }
  EXPECT_GT(at_27.tiles, 10u);
  EXPECT_EQ(at_27.sha256, Digest().sha256);
}

}  // namespace
}  // namespace atlas
