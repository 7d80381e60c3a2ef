// A spool knows which atlas it sent to last, however often the program was restarted meanwhile.
#include "client/vehicle/sent_atlas.h"

#include <gtest/gtest.h>

#include "client/vehicle/stored_file.h"
#include "tests/client/vehicle/spool_peer.h"

namespace atlas {
namespace {

const std::string kThis(16, 'a');
const std::string kOther(16, 'b');

class SentAtlasTest : public testing::Test {
 protected:
  // A run of the program that sends one keyframe to this atlas.
  SpoolReport Run(const PeerAtlas& atlas) {
    UploadSpool spool = OpenSpool(folder_);
    EXPECT_TRUE(PutOne(spool, next_++).ok());
    UploadPeer peer({}, 1 << 30, {}, atlas);
    const auto report = peer.Take(spool);
    EXPECT_TRUE(report) << report.error().message();
    return report.value_or(SpoolReport());
  }
  fs::path file() const { return folder_.path() / kSentAtlasFileName; }
  Bytes Contents() const { return *LoadFile(file(), 4096); }
  void Overwrite(const Bytes& bytes) {
    ASSERT_TRUE(StoreFile(file(), bytes, Durability::kWhole).ok());
  }

  const TestFolder folder_;
  std::uint32_t next_ = 0;
};

TEST_F(SentAtlasTest, ARestoreIsToldOnceByWhicheverRunMeetsIt) {
  EXPECT_FALSE(Run({kThis, 1}).is_restored);
  EXPECT_FALSE(Run({kThis, 1}).is_restored);
  EXPECT_TRUE(Run({kThis, 5}).is_restored);
  EXPECT_FALSE(Run({kThis, 5}).is_restored);
  EXPECT_TRUE(Run({kThis, 1}).is_restored) << "a backup of before that restore";
}

TEST_F(SentAtlasTest, AnAtlasMadeAnewIsToldThoughItsEpochIsTheSame) {
  EXPECT_FALSE(Run({kThis, 1}).is_restored);
  const SpoolReport report = Run({kOther, 1});
  EXPECT_TRUE(report.is_restored);
  EXPECT_TRUE(report.problem.ok());
  EXPECT_FALSE(Run({kOther, 1}).is_restored);
}

TEST_F(SentAtlasTest, ARestoreWithinARunIsToldOnce) {
  UploadSpool spool = OpenSpool(folder_);
  for (const std::uint64_t epoch : {1U, 2U, 2U}) {
    UploadPeer peer({}, 1 << 30, {}, {kThis, epoch});
    const auto report = peer.Take(spool);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->is_restored, epoch == 2 && next_ == 1);
    ++next_;
  }
}

// What is told with no report is told with the next one.
TEST_F(SentAtlasTest, ASendThatFailsLeavesItToTheNext) {
  {
    UploadSpool spool = OpenSpool(folder_);
    ASSERT_TRUE(PutOne(spool, 0).ok());
    ASSERT_TRUE(PutOne(spool, 1).ok());
    UploadPeer cut({}, 1, {}, {kThis, 1});  // acknowledges one
    EXPECT_FALSE(cut.Take(spool));
  }
  {
    UploadSpool spool = OpenSpool(folder_);
    UploadPeer cut({}, 0, {}, {kThis, 2});
    EXPECT_FALSE(cut.Take(spool));
  }
  next_ = 2;
  EXPECT_TRUE(Run({kThis, 2}).is_restored);
}

TEST_F(SentAtlasTest, ADaemonThatDoesNotSayWhichAtlasItHasIsNoOther) {
  EXPECT_FALSE(Run({kThis, 3}).is_restored);
  EXPECT_FALSE(Run({"", 0}).is_restored);
  EXPECT_FALSE(Run({kThis, 3}).is_restored);
}

TEST_F(SentAtlasTest, TheFileIsAsDocumented) {
  Run({kThis, 0x0102});
  Bytes expected{'R', 'A', 'V', 'S', 1};
  expected.insert(expected.end(), kThis.begin(), kThis.end());
  expected.insert(expected.end(), {2, 1, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(Contents(), WithChecksum(expected));
  EXPECT_FALSE(fs::exists(file().string() + ".partial"));
}

TEST_F(SentAtlasTest, AMissingFileIsAsIfNothingWasSent) {
  Run({kThis, 1});
  fs::remove(file());
  const SpoolReport report = Run({kThis, 2});
  EXPECT_FALSE(report.is_restored);
  EXPECT_TRUE(report.problem.ok());
  EXPECT_TRUE(Run({kThis, 3}).is_restored);
}

TEST_F(SentAtlasTest, ADamagedFileIsAsIfNothingWasSentAndIsTold) {
  Run({kThis, 1});
  const Bytes whole = Contents();
  Bytes other = whole;
  other[3] = 'K';
  other = WithChecksum(Bytes(other.begin(), other.end() - 8));
  Bytes longer(whole.begin(), whole.end() - 8);
  longer.push_back(0);
  std::vector<Bytes> damaged{{}, other, WithChecksum(longer)};
  for (std::size_t size = 1; size < whole.size(); ++size) {
    damaged.emplace_back(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
  }
  for (std::size_t byte = 0; byte < whole.size(); ++byte) {
    damaged.push_back(whole);
    damaged.back()[byte] ^= 1U;
  }
  std::uint64_t epoch = 1;
  for (const Bytes& bytes : damaged) {
    Overwrite(bytes);
    SentAtlas sent(folder_.path());
    AtlasIdentity now;
    now.atlas_id = Bytes(16, 'a');
    now.epoch = ++epoch;
    EXPECT_FALSE(sent.IsAnother(now));
    EXPECT_EQ(sent.TakeProblem().code(), StatusCode::kInvalidData);
    EXPECT_TRUE(sent.TakeProblem().ok());
  }
  Overwrite({1, 2, 3});
  const SpoolReport report = Run({kThis, 1});
  EXPECT_FALSE(report.is_restored);
  EXPECT_EQ(report.problem.code(), StatusCode::kInvalidData);
  EXPECT_EQ(report.skipped, 0U);
  EXPECT_TRUE(Run({kThis, 1}).problem.ok());
  EXPECT_TRUE(Run({kThis, 2}).is_restored);
}

// A directory opens, and every read of it fails, as on a bad sector.
TEST_F(SentAtlasTest, AFileThatCannotBeReadNowStaysAndIsReadLater) {
  Run({kThis, 1});
  const fs::path elsewhere = folder_.path() / "elsewhere";
  fs::rename(file(), elsewhere);
  fs::create_directory(file());
  UploadSpool spool = OpenSpool(folder_);
  UploadPeer meanwhile({}, 1 << 30, {}, {kThis, 2});
  const auto blind = meanwhile.Take(spool);
  ASSERT_TRUE(blind) << blind.error().message();
  EXPECT_FALSE(blind->is_restored);
  EXPECT_FALSE(blind->problem.ok());
  fs::remove(file());
  fs::rename(elsewhere, file());
  UploadPeer peer({}, 1 << 30, {}, {kThis, 2});
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->is_restored);
  EXPECT_TRUE(report->problem.ok());
}

}  // namespace
}  // namespace atlas
