// Keyframes and sessions that an index lost: they are stored a second time when they are sent
// again, and a repair makes one of the two, as if they had been sent once.
#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/server/service/service_fixture.h"
#include "tests/server/store/turned_bits.h"

namespace atlas {
namespace {

constexpr std::uint32_t kDrive = 8;

class LostKeysTest : public ServiceTest {
 protected:
  LostKeysTest() { surveys_ = {0, 0}; }

  std::filesystem::path Database() const { return directory_ / "data" / "atlas.db"; }
  void Fill() {
    Open(1);
    UploadDrive(kDrive);
    intact_ = Digest();
  }
  void Tamper(const std::string& sql) {
    Close();
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(Database().c_str(), &db), SQLITE_OK);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
    Open(1);
  }
  // The index of keys finds number 5 (id 6) of the first session no more.
  void LoseKeyframe() {
    Close();
    testing::TurnBits(Database(), "sqlite_autoindex_keyframes_1", {4, 9, 1, 1, 5, 6}, 4, 64);
    Open(1);
  }
  void LoseSession() {
    Close();
    testing::TurnBits(Database(), "sqlite_autoindex_sessions_1", "busday", 0, 32);
    Open(1);
  }
  Result<VerifyReport> Repair() {
    return service_->Verify({.repair = true, .author = "operator"}, Long());
  }
  void ExpectWhole(const AtlasDigest& expected) {
    const auto report = service_->Verify({.rebuild = true}, Long());
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->damaged + report->mismatched, 0U) << report->findings.at(0);
    EXPECT_EQ(Digest().sha256, expected.sha256);
    EXPECT_EQ(store_->ReadCounts()->keyframes, kDrive);
  }
  std::string Events() {
    std::string text;
    const auto events = store_->ListEvents(0, 1'000).value();
    for (const Event& event : events) {
      text +=
          std::string(EventName(event.kind)) + ": " + event.subject + ": " + event.detail + "\n";
    }
    return text;
  }

  AtlasDigest intact_;
};

TEST_F(LostKeysTest, AKeyframeThatIsStoredTwiceBecomesOne) {
  Fill();
  LoseKeyframe();
  const auto again = Upload(DriveUpload(5));
  ASSERT_TRUE(again) << again.error().message();
  ASSERT_FALSE(again->is_duplicate) << "the index found it";
  const auto found = service_->Verify({}, Long());
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_GT(found->damaged, 0U);
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_EQ(repaired->given_up, 0U);
  EXPECT_THAT(Events(), ::testing::HasSubstr("keyframe bus/day/5: it was stored twice"));
  ExpectWhole(intact_);
  EXPECT_TRUE(Upload(DriveUpload(5))->is_duplicate);
  EXPECT_EQ(store_->CheckRevision(kDrive).code(), StatusCode::kNotFound)
      << "what there was of the other one is gone";
}

TEST_F(LostKeysTest, TilesOfAKeyframeThatIsStoredTwiceAreNotFused) {
  Fill();
  LoseKeyframe();
  ASSERT_TRUE(Upload(DriveUpload(5)));
  Result<AtlasDigest> digest = Error(StatusCode::kTimeout, "");
  for (int i = 0; !digest && digest.error().code() == StatusCode::kTimeout && i < 1'000; ++i) {
    now_ms_ += 60'000;  // they are tried again
    digest = service_->Digest({std::chrono::milliseconds(50), {}});
  }
  ASSERT_FALSE(digest);
  EXPECT_EQ(digest.error().code(), StatusCode::kInvalidData);
  EXPECT_THAT(digest.error().message(), ::testing::HasSubstr("is stored twice"));
}

// Only the second one is found under the key.
TEST_F(LostKeysTest, ACorrectionOfTheSecondOneIsKept) {
  const auto move = [this] {
    return Move({{{{"bus", "day"}, 5}, PoseOf({3.0, 1.0, 1.8, 5.0})}});
  };
  Fill();
  ASSERT_TRUE(move());
  const AtlasDigest moved = Digest();
  Close();
  std::filesystem::remove_all(directory_ / "data");
  Fill();
  LoseKeyframe();
  ASSERT_TRUE(Upload(DriveUpload(5)));
  ASSERT_TRUE(move());
  ASSERT_TRUE(Repair());
  ExpectWhole(moved);
}

// The index found the second one for a while, and then the first again.
TEST_F(LostKeysTest, ACorrectionOfTheSecondOneThatTheFirstHadLaterIsNotTaken) {
  const auto move = [this](double x_m) {
    return Move({{{{"bus", "day"}, 5}, PoseOf({x_m, 1.0, 1.8, 5.0})}});
  };
  Fill();
  ASSERT_TRUE(move(3.0));
  const AtlasDigest moved = Digest();
  Close();
  std::filesystem::remove_all(directory_ / "data");
  Fill();
  LoseKeyframe();
  ASSERT_FALSE(Upload(DriveUpload(5))->is_duplicate);
  ASSERT_TRUE(move(2.0));
  Close();
  testing::TurnBits(Database(), "sqlite_autoindex_keyframes_1", {4, 9, 1, 1, 5, 9}, 4, 1);
  testing::TurnBits(Database(), "sqlite_autoindex_keyframes_1", {4, 9, 1, 1, 69, 6}, 4, 64);
  Open(1);
  const auto later = move(3.0);
  ASSERT_TRUE(later) << later.error().message();
  EXPECT_EQ(store_->ReadKeyframeRecord(6)->pose, PoseOf({3.0, 1.0, 1.8, 5.0}));
  ASSERT_TRUE(Repair());
  ExpectWhole(moved);
}

TEST_F(LostKeysTest, OtherBytesUnderTheKeyGo) {
  Fill();
  LoseKeyframe();
  UploadRequest other = DriveUpload(5);
  other.blob = DriveUpload(6).blob;
  ASSERT_TRUE(Upload(std::move(other)));
  ASSERT_TRUE(Repair());
  EXPECT_THAT(Events(), ::testing::HasSubstr("another one was stored under its key"));
  ExpectWhole(intact_);
}

TEST_F(LostKeysTest, TheSecondOneHealsTheFirst) {
  for (const char* damage : {"UPDATE keyframes SET blob = zeroblob(blob_bytes) WHERE id = 6",
                             "UPDATE keyframes SET time_ms = time_ms + 1 WHERE id = 6"}) {
    SCOPED_TRACE(damage);
    Fill();
    LoseKeyframe();
    ASSERT_TRUE(Upload(DriveUpload(5)));
    Close();
    const auto revision =
        testing::AskDatabase(Database(), "SELECT revision FROM keyframes WHERE id = 6");
    Tamper(damage);
    const auto repaired = Repair();
    ASSERT_TRUE(repaired) << repaired.error().message();
    EXPECT_EQ(repaired->given_up, 0U);
    ExpectWhole(intact_);
    Close();
    EXPECT_EQ(testing::AskDatabase(Database(), "SELECT revision FROM keyframes WHERE id = 6"),
              revision)
        << "at which it was uploaded";
    std::filesystem::remove_all(directory_ / "data");
  }
}

// Its index still has the key that it was written with.
TEST_F(LostKeysTest, ARowWithTheKeyOfAnotherGetsItsOwnBack) {
  for (const std::uint8_t mask : std::vector<std::uint8_t>{6, 64}) {  // number 3, and none
    SCOPED_TRACE(int{mask});
    Fill();
    Close();
    const std::string revision(1, static_cast<char>(testing::AskDatabase(
                                      Database(), "SELECT revision FROM keyframes WHERE id = 6")));
    // Its number, 1,500 ms, its revision, cells of 200,000 um.
    testing::TurnBits(Database(), "", "\x05\x05\xDC" + revision + "\x03\x0D\x40", 0, mask);
    Open(1);
    const auto repaired = Repair();
    ASSERT_TRUE(repaired) << repaired.error().message();
    EXPECT_EQ(repaired->given_up, 0U);
    ExpectWhole(intact_);
    Close();
    std::filesystem::remove_all(directory_ / "data");
  }
}

// It takes six bytes: a bit of the upper two is beyond what a number may be.
TEST_F(LostKeysTest, ABitBeyondTheNumberOfAKeyframeIsDamageOfItsRow) {
  constexpr std::uint32_t kFirst = 0x8000'0001U;
  const auto upload = [](std::uint32_t i) {
    UploadRequest request = DriveUpload(i);
    request.key.sequence = kFirst + i;
    return request;
  };
  Open(1);
  for (std::uint32_t i = 0; i < kDrive; ++i) {
    ASSERT_TRUE(Upload(upload(i)));
  }
  intact_ = Digest();
  Close();
  // Of keyframe 5 and its time, 1,500 ms.
  testing::TurnBits(Database(), "", std::string("\0\0\x80\0\0\x06\x05\xDC", 8), 1, 1);
  ASSERT_EQ(testing::AskDatabase(Database(), "SELECT sequence FROM keyframes WHERE id = 6"),
            (std::int64_t{1} << 32) + kFirst + 5);
  Open(1);
  const auto found = service_->Verify({}, Long());
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_GT(found->damaged, 0U);
  const auto made_anew = Await<std::uint32_t>([this](auto done) {
    store_->RepairTables(TableRepair::kIndexes, "tester", std::move(done));
  });
  EXPECT_FALSE(made_anew) << "an index tells what the row was";
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_EQ(repaired->given_up, 0U);
  EXPECT_TRUE(Upload(upload(5))->is_duplicate);
  ExpectWhole(intact_);
}

// Of another keyframe, of one that is damaged, and of none.
TEST_F(LostKeysTest, AnIndexThatNamesAnotherRowEndsAnUpload) {
  for (const std::uint8_t mask : std::vector<std::uint8_t>{1, 2, 4, 64}) {
    SCOPED_TRACE(int{mask});
    Fill();
    Tamper("UPDATE keyframes SET time_ms = 1 WHERE id = 4");
    Close();
    testing::TurnBits(Database(), "sqlite_autoindex_keyframes_1", {4, 9, 1, 1, 5, 6}, 5, mask);
    Open(1);
    for (const std::uint32_t sequence : {5U, 6U, 4U, 20U}) {
      const auto put = Upload(DriveUpload(sequence));
      EXPECT_TRUE(put || put.error().code() == StatusCode::kUnavailable) << put.error().message();
    }
    Tamper("DELETE FROM keyframes WHERE id = 4");
    const auto repaired = Repair();
    ASSERT_TRUE(repaired) << repaired.error().message();
    EXPECT_TRUE(Upload(DriveUpload(5))->is_duplicate);
    EXPECT_EQ(service_->Verify({.rebuild = true}, Long())->damaged, 0U);
    Close();
    std::filesystem::remove_all(directory_ / "data");
  }
}

// It names a session that never was.
TEST_F(LostKeysTest, ASessionThatADamagedKeyframeNamesIsNotMade) {
  Fill();
  Tamper("UPDATE keyframes SET session_id = 65, time_ms = time_ms + 1 WHERE id = 6");
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_EQ(store_->ListSessions({}, 10)->size(), 1U);
  ASSERT_TRUE(Upload(DriveUpload(5)));
  ExpectWhole(intact_);
}

// Two lines of one batch: of keyframes 5 and 6.
TEST_F(LostKeysTest, ALineOfPosesWithTheKeyOfAnotherGetsItsOwnBack) {
  Fill();
  ASSERT_TRUE(Move({{{{"bus", "day"}, 4}, PoseOf({3.0, 1.0, 1.8, 5.0})},
                    {{{"bus", "day"}, 5}, PoseOf({4.0, 1.0, 1.8, 5.0})}}));
  const AtlasDigest moved = Digest();
  Close();
  const std::string revision(1, static_cast<char>(testing::AskDatabase(
                                    Database(), "SELECT max(revision) FROM pose_history")));
  testing::TurnBits(Database(), "pose_history", "\x06" + revision + "tester", 0, 3);
  Open(1);
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  ExpectWhole(moved);
  EXPECT_EQ(DigestAt(kDrive).sha256, DigestAt(kDrive).sha256) << "its past can be read";
}

// The older one has the key of the other, or the younger one.
TEST_F(LostKeysTest, OfTwoLinesOfPosesWithOneKeyTheWholeOneStays) {
  for (const char* const id : {"\x05", "\x06"}) {
    SCOPED_TRACE(int{*id});
    Fill();
    ASSERT_TRUE(Move({{{{"bus", "day"}, 4}, PoseOf({3.0, 1.0, 1.8, 5.0})},
                      {{{"bus", "day"}, 5}, PoseOf({4.0, 1.0, 1.8, 5.0})}}));
    const AtlasDigest moved = Digest();
    Close();
    const std::string revision(1, static_cast<char>(testing::AskDatabase(
                                      Database(), "SELECT max(revision) FROM pose_history")));
    testing::TurnBits(Database(), "pose_history", id + revision + "tester", 0, 3);
    testing::TurnBits(Database(), "sqlite_autoindex_pose_history_1", id + revision, 0, 64);
    Open(1);
    const auto repaired = Repair();
    ASSERT_TRUE(repaired) << repaired.error().message();
    ExpectWhole(moved);
    EXPECT_EQ(store_->CheckRevision(kDrive).code(), StatusCode::kNotFound)
        << "where one of them was is not known";
    Close();
    EXPECT_EQ(testing::AskDatabase(
                  Database(), "SELECT sum(keyframe_id) FROM pose_history WHERE author = 'tester'"),
              *id == 5 ? 6 : 5)
        << "by whom the other was moved is told as ever";
    std::filesystem::remove_all(directory_ / "data");
  }
}

// The history of its states is gone, too, so that who opens the atlas cannot tell what it was.
TEST_F(LostKeysTest, TheIndexTellsTheNameOfADamagedSession) {
  Fill();
  Tamper("DELETE FROM session_states");
  Close();
  testing::TurnBits(Database(), "sessions", "busday", 0, 2);
  Open(1);
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_THAT(Events(), ::testing::Not(::testing::HasSubstr("nothing vouches")));
  ExpectWhole(intact_);
}

TEST_F(LostKeysTest, ASessionThatBeganTwiceBecomesOne) {
  Fill();
  LoseSession();
  ASSERT_FALSE(Upload(DriveUpload(5))->is_duplicate);
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_EQ(store_->ListSessions({}, 10)->size(), 1U);
  ExpectWhole(intact_);
}

TEST_F(LostKeysTest, ARetractionOfTheSecondSessionIsOfBoth) {
  Fill();
  LoseSession();
  ASSERT_TRUE(Upload(DriveUpload(5)));
  ASSERT_TRUE(Change("day", SessionAction::kRetract));
  ASSERT_TRUE(Repair());
  EXPECT_EQ(Digest().tiles, 0U);
  ASSERT_TRUE(Change("day", SessionAction::kRestore));
  ExpectWhole(intact_);
}

// The second one was in the map already when it was found out that it is to be none.
TEST_F(LostKeysTest, APurgeOfTheFirstSessionTakesTheTilesOfTheSecond) {
  Fill();
  ASSERT_TRUE(Change("day", SessionAction::kPurge));
  LoseSession();
  ASSERT_TRUE(Upload(DriveUpload(5)));
  ASSERT_GT(Digest().tiles, 0U);
  ASSERT_TRUE(Repair());
  EXPECT_EQ(Digest().tiles, 0U);
  EXPECT_EQ(service_->Verify({.rebuild = true}, Long())->mismatched, 0U);
}

TEST_F(LostKeysTest, APurgeOfOneSessionIsOfBoth) {
  for (const bool is_of_the_first : {false, true}) {
    SCOPED_TRACE(is_of_the_first);
    Fill();
    if (is_of_the_first) {
      ASSERT_TRUE(Change("day", SessionAction::kPurge));
      Digest();
    }
    LoseSession();
    ASSERT_TRUE(Upload(DriveUpload(5)));
    if (!is_of_the_first) {
      ASSERT_TRUE(Change("day", SessionAction::kPurge));
    }
    ASSERT_TRUE(Repair());
    EXPECT_EQ(Digest().tiles, 0U);
    EXPECT_EQ(store_->ReadCounts()->keyframes, 0U);
    EXPECT_EQ(store_->FindSession({"bus", "day"}).value()->state, SessionState::kPurged);
    EXPECT_EQ(service_->Verify({.rebuild = true}, Long())->damaged, 0U);
    Close();
    std::filesystem::remove_all(directory_ / "data");
  }
}

}  // namespace
}  // namespace atlas
