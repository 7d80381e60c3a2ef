// What is read back in the background.
#include "server/service/verification/scrubber.h"

#include <mutex>

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/server/service/service_fixture.h"
#include "tests/server/store/turned_bits.h"

namespace atlas {
namespace {

class ScrubberTest : public ServiceTest {
 protected:
  // A pass after the other.
  std::unique_ptr<Scrubber> Scrub(double bytes_per_s, bool checks_indexes = false) {
    return std::make_unique<Scrubber>(
        *store_, changes_,
        [this](LogLevel level, const std::string& line) {
          const std::lock_guard lock(mutex_);
          lines_.push_back((level == LogLevel::kError ? "error: " : "") + line);
        },
        ScrubOptions{bytes_per_s, std::chrono::seconds(0), std::chrono::seconds(0),
                     checks_indexes});
  }
  template <typename Condition>
  static bool ComesTrue(Condition condition) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!condition() && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return condition();
  }
  std::vector<std::string> Lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  void Spoil(const char* sql) {
    Close();
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((directory_ / "data" / "atlas.db").c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(db);
    Open(1);
  }

  // Looks at the indexes, and at nothing else, until it has said `what`.
  bool Says(const std::string& what) {
    const auto scrubber = Scrub(0, true);
    return ComesTrue([&] {
      const auto lines = Lines();
      return std::any_of(lines.begin(), lines.end(), [&](const std::string& line) {
        return line.find(what) != std::string::npos;
      });
    });
  }
  // The index of keys finds number 2 (id 3) no more.
  void LoseKeyframe() {
    Close();
    testing::TurnBits(directory_ / "data" / "atlas.db", "sqlite_autoindex_keyframes_1",
                      {4, 9, 1, 1, 2, 3}, 4, 64);
    Open(1);
  }

  ChangeSignal changes_;
  std::mutex mutex_;
  std::vector<std::string> lines_;
};

TEST_F(ScrubberTest, DamageIsFoundBeforeAnybodyAsks) {
  Open(1);
  UploadDrive(4);
  const AtlasDigest intact = Digest();
  Spoil(
      "UPDATE keyframes SET blob = zeroblob(blob_bytes) WHERE sequence = 1;"
      "UPDATE tiles SET blob = zeroblob(blob_bytes) WHERE key = (SELECT min(key) FROM tiles)");
  {
    const auto scrubber = Scrub(1e9);
    EXPECT_TRUE(ComesTrue([&] { return scrubber->figures().passes > 0; }));
    EXPECT_GE(scrubber->figures().damaged, 2u);
  }
  EXPECT_EQ(store_->ListDamagedKeyframes()->size(), 1u);
  EXPECT_THAT(Lines(), ::testing::Contains(::testing::HasSubstr("store: the blob of keyframe 2")));
  ASSERT_TRUE(Upload(DriveUpload(1)));
  EXPECT_EQ(Digest().sha256, intact.sha256);
  lines_.clear();
  const auto scrubber = Scrub(1e9);
  EXPECT_TRUE(ComesTrue([&] { return scrubber->figures().passes > 0; }));
  EXPECT_EQ(scrubber->figures().damaged, 0u) << Lines().front();
}

TEST_F(ScrubberTest, ItKeepsToItsPaceAndStopsInTheMiddle) {
  Open(1);
  UploadDrive(4);
  Digest();
  const auto scrubber = Scrub(1'000);  // one keyframe in many seconds
  EXPECT_TRUE(ComesTrue([&] { return scrubber->figures().checked == 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(scrubber->figures().checked, 1u);
  const auto begin = std::chrono::steady_clock::now();
  scrubber->Stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  EXPECT_EQ(scrubber->figures().passes, 0u);
}

TEST_F(ScrubberTest, IndexesThatAreWholeStayAsTheyAre) {
  Open(1);
  UploadDrive(4);
  Digest();
  const std::uint64_t revision = store_->revision();
  EXPECT_TRUE(Says("indexes are whole"));
  EXPECT_EQ(store_->revision(), revision);
}

TEST_F(ScrubberTest, AnIndexThatLostAKeyframeIsMadeAnew) {
  for (const bool is_sent_before : {false, true}) {
    Open(1);
    UploadDrive(4);
    const AtlasDigest intact = Digest();
    LoseKeyframe();
    if (is_sent_before) {
      EXPECT_FALSE(Upload(DriveUpload(2))->is_duplicate) << "the index has it";
    }
    EXPECT_TRUE(Says("indexes were made anew")) << Lines().back();
    EXPECT_THAT(Lines(), ::testing::Contains(::testing::HasSubstr(
                             "error: scrub: store: the index of keyframes by name is damaged")));
    service_->WaitUntilClean(Long());
    EXPECT_TRUE(Upload(DriveUpload(2))->is_duplicate);
    EXPECT_EQ(Digest().sha256, intact.sha256);
    const auto report = service_->Verify({.rebuild = true}, Long());
    EXPECT_EQ(report->mismatched, 0U) << report->findings.at(0);
    Close();
    std::filesystem::remove_all(directory_ / "data");
    lines_.clear();
  }
}

TEST_F(ScrubberTest, OfDamagedRowsNoIndexIsMadeAnew) {
  Open(1);
  UploadDrive(4);
  Digest();
  Spoil("UPDATE keyframes SET time_ms = 9 WHERE id = 1");
  LoseKeyframe();
  EXPECT_TRUE(Says("indexes were not made anew")) << Lines().back();
}

}  // namespace
}  // namespace atlas
