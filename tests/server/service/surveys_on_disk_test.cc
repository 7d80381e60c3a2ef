// A service whose surveys are on disk: what they save, and that no tile is ever made of the wrong
// ones.
#include <random>

#include <sqlite3.h>

#include "tests/server/service/directory_files.h"
#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

class SurveysOnDiskTest : public ServiceTest {
 protected:
  SurveysOnDiskTest() {
    survey_files_.directory = directory_ / "surveys";
    survey_files_.min_free_bytes = 0;
  }

  fs::path database() const { return directory_ / "data" / "atlas.db"; }

  void Execute(const std::string& sql) const {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(database().c_str(), &db), SQLITE_OK);
    sqlite3_busy_timeout(db, 10'000);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }

  // Of an atlas that was fed the same, and keeps nothing.
  AtlasDigest DigestOfAnother(const std::vector<UploadRequest>& uploads) {
    const SurveyFilesOptions files = std::exchange(survey_files_, {});
    Open(1, "another");
    for (const UploadRequest& upload : uploads) {
      EXPECT_TRUE(Upload(upload).has_value());
    }
    const AtlasDigest digest = Digest();
    survey_files_ = files;
    return digest;
  }

  // What the files and the atlas say after a restart and another keyframe.
  AtlasDigest DigestAfterRestart() {
    Open(1);
    EXPECT_TRUE(Upload(DriveUpload(8)).has_value());
    return Digest();
  }
};

TEST_F(SurveysOnDiskTest, AfterARestartNoKeyframeIsReadAgain) {
  Open(1);
  UploadDrive(8);
  Digest();
  Close();
  ASSERT_FALSE(FilesIn(survey_files_.directory).empty());
  Execute("UPDATE keyframes SET blob = zeroblob(blob_bytes)");  // whoever reads one is told
  const AtlasDigest digest = DigestAfterRestart();
  EXPECT_EQ(service_->ReadStatus()->counts.dirty_tiles, 0u);
  std::vector<UploadRequest> uploads;
  for (std::uint32_t i = 0; i < 9; ++i) {
    uploads.push_back(DriveUpload(i));
  }
  EXPECT_EQ(digest.sha256, DigestOfAnother(uploads).sha256);
}

TEST_F(SurveysOnDiskTest, WhatMemoryHasNoRoomForIsOnDisk) {
  surveys_ = {0, 0};
  Open(1);
  UploadDrive(8);
  Digest();
  const auto status = service_->ReadStatus();
  ASSERT_TRUE(status.has_value());
  EXPECT_EQ(status->kept_bytes, 0u);
  EXPECT_GT(status->kept_disk_bytes, 0u);
}

// The keyframes that came after the copy are not those that come now, though both have the same
// numbers and the atlas the same revision.
TEST_F(SurveysOnDiskTest, AnAtlasPutBackFromAnOlderCopyIsItsOwn) {
  for (const bool is_restarted : {false, true}) {
    Close();
    fs::remove_all(directory_ / "data");
    fs::remove_all(survey_files_.directory);
    Open(1);
    UploadDrive(4);
    Digest();
    const fs::path copy = directory_ / (is_restarted ? "after.db" : "running.db");
    Execute("VACUUM INTO '" + copy.string() + "'");
    if (is_restarted) {
      Open(1);
    }
    for (std::uint32_t i = 4; i < 8; ++i) {
      ASSERT_TRUE(Upload(DriveUpload(i)).has_value());
    }
    Digest();
    Close();
    fs::copy_file(copy, database(), fs::copy_options::overwrite_existing);
    Open(1);
    std::vector<UploadRequest> uploads;
    for (std::uint32_t i = 0; i < 4; ++i) {
      uploads.push_back(DriveUpload(i));
    }
    for (std::uint32_t i = 4; i < 9; ++i) {
      uploads.push_back(DriveUpload(i));
      uploads.back().blob =
          EncodeKeyframe(testing::StreetKeyframe(TestProfile(), 24, 500 + i));  // another world
      ASSERT_TRUE(Upload(uploads.back()).has_value());
    }
    const AtlasDigest digest = Digest();
    fs::remove_all(directory_ / "another");
    EXPECT_EQ(digest.sha256, DigestOfAnother(uploads).sha256) << is_restarted;
  }
}

TEST_F(SurveysOnDiskTest, DamagedFilesAreNotBelieved) {
  Open(1);
  UploadDrive(8);
  Digest();
  Close();
  std::vector<UploadRequest> uploads;
  for (std::uint32_t i = 0; i < 9; ++i) {
    uploads.push_back(DriveUpload(i));
  }
  const AtlasDigest expected = DigestOfAnother(uploads);
  Close();
  fs::copy(directory_ / "data", directory_ / "data_before", fs::copy_options::recursive);
  fs::copy(survey_files_.directory, directory_ / "surveys_before");
  std::mt19937 random(1);
  for (int round = 0; round < 12; ++round) {
    fs::remove_all(directory_ / "data");
    fs::remove_all(survey_files_.directory);
    fs::copy(directory_ / "data_before", directory_ / "data", fs::copy_options::recursive);
    fs::copy(directory_ / "surveys_before", survey_files_.directory);
    for (const fs::path& path : FilesIn(survey_files_.directory)) {
      std::string bytes = Contents(path);
      const std::size_t at = random() % (round % 2 == 0 ? 64 : bytes.size());
      if (round % 3 == 2) {
        bytes.resize(at);
      } else {
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
      }
      Overwrite(path, bytes);
    }
    EXPECT_EQ(DigestAfterRestart().sha256, expected.sha256) << "round " << round;
    Close();
  }
}

TEST_F(SurveysOnDiskTest, FilesMayVanishAtAnyTime) {
  surveys_ = {0, 0};  // each is read each time
  Open(1);
  UploadDrive(4);
  Digest();
  fs::remove_all(survey_files_.directory);
  for (std::uint32_t i = 4; i < 8; ++i) {
    ASSERT_TRUE(Upload(DriveUpload(i)).has_value());
  }
  std::vector<UploadRequest> uploads;
  for (std::uint32_t i = 0; i < 8; ++i) {
    uploads.push_back(DriveUpload(i));
  }
  const AtlasDigest digest = Digest();
  EXPECT_FALSE(FilesIn(survey_files_.directory).empty()) << "others are written";
  EXPECT_EQ(digest.sha256, DigestOfAnother(uploads).sha256);
}

}  // namespace
}  // namespace atlas
