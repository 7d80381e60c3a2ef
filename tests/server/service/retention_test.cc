// A store that is nearly full makes room by itself where it is told to, and nobody sees a
// difference in the map.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "server/service/compaction/compaction_window.h"
#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kKeyframes = 5;  // a pass
constexpr std::int64_t kPass_ms = 1'000'000;

class RetentionTest : public ServiceTest {
 protected:
  RetentionTest() {
    profile_.preset = FusionPreset::kBounded;
    compaction_.look_every = milliseconds(5);
    compaction_.step_keyframes = kKeyframes;
  }

  // The drive of the fixture, `pass` + 1 times some minutes later.
  UploadRequest PassUpload(std::uint32_t pass, std::uint32_t i) const {
    UploadRequest request = DriveUpload(i, "pass" + std::to_string(pass), profile_);
    request.time_ms += kPass_ms * (pass + 1);
    return request;
  }
  void UploadPasses(std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t pass = first; pass < end; ++pass) {
      for (std::uint32_t i = 0; i < kKeyframes; ++i) {
        const auto put = Upload(PassUpload(pass, i));
        ASSERT_TRUE(put.has_value()) << put.error().message();
      }
    }
  }
  // The store is so far filled then.
  void LimitTo(double share, bool is_compacting) {
    const auto used = static_cast<double>(store_->ReadRoom().used_bytes);
    service_->SetRetention(
        {{.store_bytes = static_cast<std::uint64_t>(used / share)}, is_compacting});
  }
  double Filled() {
    const RoomFigures room = store_->ReadRoom();
    return static_cast<double>(room.used_bytes) / static_cast<double>(room.limits.store_bytes);
  }
  std::uint64_t Dropped() { return service_->ReadStatus()->counts.compacted; }
  template <typename Condition>
  static bool Until(const Condition& condition) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > deadline) {
        return false;
      }
      std::this_thread::sleep_for(milliseconds(5));
    }
    return true;
  }
  void ExpectSound() {
    const auto report = service_->Verify({.rebuild = true}, Long());
    ASSERT_TRUE(report.has_value()) << report.error().message();
    EXPECT_EQ(report->damaged, 0u);
    EXPECT_EQ(report->mismatched, 0u);
  }
};

TEST_F(RetentionTest, TheOldestPassesGoUntilThereIsRoom) {
  Open();
  UploadPasses(0, 8);
  const AtlasDigest before = Digest();
  LimitTo(0.95, true);
  ASSERT_TRUE(Until([this] { return Filled() < 0.85; })) << Filled();
  Open();  // a step under way ends first; there is no limit any more
  const std::uint64_t dropped = Dropped();
  EXPECT_GT(dropped, 0u);
  EXPECT_EQ(dropped % kKeyframes, 0u) << "a pass at a step";
  EXPECT_LT(dropped, 5 * kKeyframes) << "no more than it takes";
  const auto sessions = service_->ListSessions({}, 100).value();
  for (std::uint32_t pass = 0; pass < 8; ++pass) {
    EXPECT_EQ(sessions[pass].compacted, pass < dropped / kKeyframes ? kKeyframes : 0) << pass;
  }
  const auto events = service_->ListEvents(0, 100).value();
  std::uint64_t steps = 0;
  for (const Event& event : events) {
    steps += event.kind == EventKind::kCompact && event.author == "retention" ? 1U : 0U;
  }
  EXPECT_EQ(steps, dropped / kKeyframes);
  EXPECT_EQ(Digest().sha256, before.sha256);
  ExpectSound();
}

TEST_F(RetentionTest, BelowItsShareOrWhereItIsOffNothingGoes) {
  Open();
  UploadPasses(0, 6);
  Digest();
  for (const bool is_compacting : {false, true}) {
    LimitTo(is_compacting ? 0.89 : 0.99, is_compacting);
    std::this_thread::sleep_for(milliseconds(200));  // forty looks
    EXPECT_EQ(Dropped(), 0u) << is_compacting;
  }
  service_->SetRetention({{}, true});
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(Dropped(), 0u) << "no limit";
}

TEST_F(RetentionTest, AStoreThatIsFullTakesUploadsAgain) {
  Open();
  UploadPasses(0, 7);
  const AtlasDigest before = Digest();
  LimitTo(1.0, false);
  const auto refused = Upload(PassUpload(7, 0));
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().reason(), StatusReason::kStoreLimit);
  EXPECT_EQ(Digest().sha256, before.sha256);
  LimitTo(1.0, true);
  for (std::uint32_t i = 0; i < kKeyframes; ++i) {
    EXPECT_TRUE(Until([&] { return Upload(PassUpload(7, i)).has_value(); })) << i;
  }
  EXPECT_GT(Dropped(), 0u);
  ExpectSound();
}

TEST_F(RetentionTest, UploadsGoOnMeanwhile) {
  Open();
  UploadPasses(0, 8);
  Digest();
  LimitTo(0.91, true);
  std::uint32_t sent = 0;
  EXPECT_TRUE(Until([&] {
    UploadRequest far = PassUpload(10 + sent / kKeyframes, sent % kKeyframes);
    far.pose.x_um += 500'000'000;
    sent += Upload(std::move(far)).has_value() ? 1U : 0U;
    return Dropped() > 0;
  }));
  EXPECT_GT(sent, 0u);
  service_->SetRetention({});
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 8 * kKeyframes + sent - Dropped());
  ExpectSound();
}

// One search of the atlas, and not one after the other.
TEST_F(RetentionTest, WhereNothingCanGoItRests) {
  Open();
  UploadPasses(0, 2);  // of which both are needed
  Digest();
  std::atomic<int> steps = 0;
  AutomaticCompaction compaction(
      *store_,
      [&](const CompactionRequest& request, const std::stop_token&) -> Result<CompactionReport> {
        EXPECT_EQ(request.author, "retention");
        ++steps;
        return CompactionReport{};
      },
      [](LogLevel, const std::string&) {}, compaction_);
  LimitTo(0.95, false);
  compaction.set_on(true);
  EXPECT_TRUE(Until([&] { return steps >= 2; }));
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(steps, 2) << "each pass once";
}

TEST_F(RetentionTest, ItBeginsAtTheUpperShareAndEndsAtTheLower) {
  Open();
  UploadPasses(0, 4);
  Digest();
  std::atomic<int> steps = 0;
  AutomaticCompaction compaction(
      *store_,
      [&](const CompactionRequest&, const std::stop_token&) -> Result<CompactionReport> {
        LimitTo(++steps == 1 ? 0.87 : 0.84, false);
        return CompactionReport{};
      },
      [](LogLevel, const std::string&) {}, compaction_);
  LimitTo(0.95, false);
  compaction.set_on(true);
  EXPECT_TRUE(Until([&] { return steps >= 2; }));
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(steps, 2) << "of four";
}

TEST_F(RetentionTest, AStepThatFailsIsPassedOver) {
  Open();
  UploadPasses(0, 3);
  Digest();
  std::mutex mutex;
  std::vector<std::int64_t> begun_ms;
  std::vector<std::string> lines;
  AutomaticCompaction compaction(
      *store_,
      [&](const CompactionRequest& request, const std::stop_token&) -> Result<CompactionReport> {
        const std::lock_guard lock(mutex);
        begun_ms.push_back(request.from_ms);
        return Error(StatusCode::kInvalidData, "keyframe 7 is damaged");
      },
      [&](LogLevel, const std::string& line) {
        const std::lock_guard lock(mutex);
        lines.push_back(line);
      },
      compaction_);
  LimitTo(0.95, false);
  compaction.set_on(true);
  EXPECT_TRUE(Until([&] {
    const std::lock_guard lock(mutex);
    return begun_ms.size() == 3;
  }));
  compaction.Stop();
  EXPECT_TRUE(std::is_sorted(begun_ms.begin(), begun_ms.end()));
  EXPECT_GT(begun_ms[2], begun_ms[1]);
  EXPECT_NE(lines.at(0).find("keyframe 7"), std::string::npos);
}

TEST_F(RetentionTest, OfAnotherPresetNothingGoesAndSomebodyIsTold) {
  profile_.preset = FusionPreset::kStrict;
  retention_.is_compacting = true;
  Open();
  UploadPasses(0, 5);
  Digest();
  std::vector<std::string> warnings;
  ServiceOptions options;
  options.retention.is_compacting = true;
  service_.reset();
  service_ = std::make_unique<AtlasService>(
      *store_, [] { return kTestNow_ms; },
      [&](LogLevel level, const std::string& message) {
        if (level == LogLevel::kWarning) {
          warnings.push_back(message);
        }
      },
      options);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("preset strict"), std::string::npos);
  EXPECT_EQ(Dropped(), 0u);
}

TEST_F(RetentionTest, ACompactionFromATimeOnLeavesWhatIsBefore) {
  Open();
  UploadPasses(0, 6);
  const AtlasDigest before = Digest();
  const std::int64_t second_ms = PassUpload(1, 0).time_ms;
  const auto done = service_->Compact({kTestNow_ms, "tester", second_ms}, Long());
  ASSERT_TRUE(done.has_value()) << done.error().message();
  EXPECT_EQ(done->stored.dropped, 2 * kKeyframes);
  EXPECT_EQ(service_->ListSessions({}, 100)->at(0).compacted, 0u);
  EXPECT_EQ(Digest().sha256, before.sha256);
}

SessionRecord Spread(std::uint64_t keyframes, std::int64_t first_ms, std::int64_t last_ms) {
  SessionRecord session;
  session.keyframes = keyframes;
  session.first_time_ms = first_ms;
  session.last_time_ms = last_ms;
  return session;
}

TEST(CompactionWindowTest, AWindowHoldsSoManyAndTheNextOneGoesOn) {
  const std::vector<SessionRecord> sessions = {Spread(100, 0, 999), Spread(100, 10'000, 10'999)};
  EXPECT_EQ(EndOfWindow(sessions, 0, 10), 100);
  EXPECT_EQ(EndOfWindow(sessions, 100, 90), 1'000);
  EXPECT_EQ(EndOfWindow(sessions, 900, 20), 10'100);
  EXPECT_EQ(EndOfWindow(sessions, 10'900, 50), 11'000) << "as many as there are";
  EXPECT_EQ(EndOfWindow(sessions, 11'000, 50), std::nullopt);
  EXPECT_EQ(EndOfWindow({}, 0, 50), std::nullopt);
}

TEST(CompactionWindowTest, DrivesBesideEachOtherShareAWindow) {
  const std::vector<SessionRecord> sessions = {Spread(100, 0, 999), Spread(100, 500, 1'499)};
  EXPECT_EQ(EndOfWindow(sessions, 500, 20), 600);
  const std::vector<SessionRecord> at_once = {Spread(100, 7, 7), Spread(100, 7, 7)};
  EXPECT_EQ(EndOfWindow(at_once, 0, 20), 8);
  EXPECT_EQ(EndOfWindow(at_once, 8, 20), std::nullopt);
}

}  // namespace
}  // namespace atlas
