// Passes over the same place again and again, preset bounded: those that matter nowhere any more
// go, and nobody sees a difference.
#include <atomic>
#include <set>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

constexpr std::uint32_t kKeyframes = 5;  // a pass
constexpr std::int64_t kPass_ms = 1'000'000;
constexpr std::int64_t kAll_ms = kTestNow_ms;

std::string NameOf(std::uint32_t pass) {
  return "pass" + std::to_string(pass);
}

class CompactionTest : public ServiceTest {
 protected:
  CompactionTest() { profile_.preset = FusionPreset::kBounded; }

  // The drive of the fixture, `pass` + 1 times some minutes later.
  UploadRequest PassUpload(std::uint32_t pass, std::uint32_t i) const {
    UploadRequest request = DriveUpload(i, NameOf(pass), profile_);
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
  Result<CompactionReport> Compact(std::int64_t before_ms, const Patience& patience = Long()) {
    return service_->Compact({before_ms, "tester"}, patience);
  }
  // Of passes first .. end - 1 alone, in an atlas that saw no others.
  AtlasDigest DigestOfPasses(std::uint32_t first, std::uint32_t end) {
    Open(2, "reference");
    UploadPasses(first, end);
    const AtlasDigest digest = Digest();
    Close();
    std::filesystem::remove_all(directory_ / "reference");
    return digest;
  }
  void ExpectSound() {
    const auto report = service_->Verify({.rebuild = true}, Long());
    ASSERT_TRUE(report.has_value()) << report.error().message();
    EXPECT_EQ(report->damaged, 0u);
    EXPECT_EQ(report->mismatched, 0u) << report->findings.front();
  }
  void Tamper(const std::string& sql) {
    Close();
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((directory_ / "data" / "atlas.db").c_str(), &db), SQLITE_OK);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }
};

TEST_F(CompactionTest, OldPassesGoAndTheAtlasStays) {
  Open();
  UploadPasses(0, 6);
  const AtlasDigest before = Digest();
  const StoreCounts counts = service_->ReadStatus()->counts;
  const auto done = Compact(kAll_ms);
  ASSERT_TRUE(done.has_value()) << done.error().message();
  EXPECT_EQ(done->stored.dropped, 3 * kKeyframes);
  EXPECT_EQ(done->stored.revision, before.revision + 1);
  EXPECT_EQ(done->stored.horizon, before.revision + 1);
  EXPECT_GT(done->tiles_checked, 10u);
  EXPECT_EQ(service_->ReadStatus()->counts.dirty_tiles, 0u);
  for (int reopened = 0; reopened < 2; ++reopened) {
    const AtlasDigest after = Digest();
    EXPECT_EQ(after.sha256, before.sha256);
    EXPECT_EQ(after.revision, done->stored.revision);
    EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 3 * kKeyframes);
    EXPECT_EQ(service_->ReadStatus()->counts.compacted, 3 * kKeyframes);
    EXPECT_EQ(service_->ReadStatus()->counts.keyframe_bytes,
              counts.keyframe_bytes - done->stored.bytes);
    const auto sessions = service_->ListSessions({}, 1'000).value();
    ASSERT_EQ(sessions.size(), 6u);
    for (std::uint32_t pass = 0; pass < 6; ++pass) {
      EXPECT_EQ(sessions[pass].state, SessionState::kLive);
      EXPECT_EQ(sessions[pass].keyframes, pass < 3 ? 0 : kKeyframes);
      EXPECT_EQ(sessions[pass].compacted, pass < 3 ? kKeyframes : 0);
    }
    ExpectSound();
    Open();
  }
}

TEST_F(CompactionTest, OnlyWhatWasTakenBeforeTheTimeGoes) {
  Open();
  UploadPasses(0, 6);
  const AtlasDigest before = Digest();
  const auto none = Compact(kPass_ms);
  ASSERT_TRUE(none.has_value());
  EXPECT_EQ(none->stored.dropped, 0u);
  EXPECT_EQ(none->stored.horizon, 0u);
  EXPECT_EQ(none->stored.revision, before.revision);
  EXPECT_EQ(Digest().revision, before.revision);
  const std::int64_t third_ms = PassUpload(1, 2).time_ms;
  EXPECT_EQ(Compact(third_ms)->stored.dropped, kKeyframes + 2);
  EXPECT_EQ(Compact(third_ms + 1)->stored.dropped, 1u);
  const auto again = Compact(third_ms + 1);
  EXPECT_EQ(again->stored.dropped, 0u);
  EXPECT_EQ(again->stored.horizon, again->stored.revision);
  EXPECT_EQ(Digest().sha256, before.sha256);
  ExpectSound();
}

// What workers know of tiles from before must not bring back what was dropped.
TEST_F(CompactionTest, LaterChangesActOnWhatRemains) {
  for (const std::size_t kept_bytes : {std::size_t{0}, std::size_t{1} << 28}) {
    surveys_ = {kept_bytes, 0};
    const std::string name = "kept" + std::to_string(kept_bytes);
    Open(2, name);
    UploadPasses(0, 6);
    Digest();
    ASSERT_EQ(Compact(kAll_ms)->stored.dropped, 3 * kKeyframes);
    ASSERT_TRUE(Change(NameOf(5), SessionAction::kRetract).has_value());
    const AtlasDigest retracted = Digest();
    ExpectSound();
    ASSERT_TRUE(Change(NameOf(4), SessionAction::kRetract).has_value());
    const AtlasDigest one_left = Digest();
    ASSERT_TRUE(Change(NameOf(3), SessionAction::kRetract).has_value());
    EXPECT_EQ(Digest().tiles, 0u);
    ASSERT_TRUE(Change(NameOf(5), SessionAction::kRestore).has_value());
    ASSERT_TRUE(Change(NameOf(4), SessionAction::kRestore).has_value());
    ASSERT_TRUE(Change(NameOf(3), SessionAction::kRestore).has_value());
    ASSERT_TRUE(Change(NameOf(0), SessionAction::kRetract).has_value());  // nothing is left of it
    UploadPasses(6, 7);
    const AtlasDigest four = Digest();
    ExpectSound();
    EXPECT_EQ(retracted.sha256, DigestOfPasses(3, 5).sha256);
    EXPECT_EQ(one_left.sha256, DigestOfPasses(3, 4).sha256);
    EXPECT_EQ(four.sha256, DigestOfPasses(3, 7).sha256);
  }
}

TEST_F(CompactionTest, SendersOfWhatWasDroppedAreAnswered) {
  Open();
  UploadPasses(0, 5);
  const AtlasDigest before = Digest();
  ASSERT_EQ(Compact(kAll_ms)->stored.dropped, 2 * kKeyframes);
  std::vector<PoseBatchRequest::Update> poses;
  for (std::uint32_t pass = 0; pass < 5; ++pass) {
    for (std::uint32_t i = 0; i < kKeyframes; ++i) {
      EXPECT_TRUE(Upload(PassUpload(pass, i))->is_duplicate);
      testing::MapPose pose = PoseAlong(i);
      pose.x_m += 0.4;
      poses.push_back({PassUpload(pass, i).key, PoseOf(pose)});
    }
  }
  UploadRequest other = PassUpload(0, 0);
  other.time_ms += 1;
  EXPECT_EQ(Upload(other).error().code(), StatusCode::kConflict);
  EXPECT_EQ(Digest().sha256, before.sha256);
  const auto moved = Move(poses);
  ASSERT_TRUE(moved.has_value()) << moved.error().message();
  EXPECT_EQ(moved->updated, 3 * kKeyframes);
  ExpectSound();
  QuantizedPose none;
  none.quaternion = {5, 5, 5, 5};
  EXPECT_EQ(Move({{PassUpload(0, 0).key, none}}).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(Move({{PassUpload(0, 99).key, PoseOf({})}}).error().code(), StatusCode::kNotFound);
}

TEST_F(CompactionTest, WhatIsNotInTheMapStays) {
  Open();
  UploadPasses(0, 6);
  const AtlasDigest all = Digest();
  ASSERT_TRUE(Change(NameOf(0), SessionAction::kRetract).has_value());
  EXPECT_EQ(Compact(kAll_ms)->stored.dropped, 2 * kKeyframes);
  EXPECT_EQ(service_->ListSessions({}, 1'000)->at(0).keyframes, kKeyframes);
  ASSERT_TRUE(Change(NameOf(0), SessionAction::kRestore).has_value());
  EXPECT_EQ(Digest().sha256, all.sha256);
  EXPECT_EQ(Compact(kAll_ms)->stored.dropped, kKeyframes);
  EXPECT_EQ(Digest().sha256, all.sha256);
  ExpectSound();
}

TEST_F(CompactionTest, ThePastBeginsWithIt) {
  Open();
  UploadPasses(0, 5);
  const AtlasDigest before = Digest();
  EXPECT_EQ(DigestAt(before.revision).sha256, before.sha256);
  const std::uint64_t horizon = Compact(kAll_ms)->stored.horizon;
  for (const std::uint64_t gone : {std::uint64_t{0}, std::uint64_t{7}, before.revision}) {
    EXPECT_EQ(service_->DigestAt(gone, Long()).error().code(), StatusCode::kNotFound);
  }
  EXPECT_EQ(DigestAt(horizon).sha256, before.sha256);
  ASSERT_TRUE(Change(NameOf(4), SessionAction::kRetract).has_value());
  EXPECT_NE(Digest().sha256, before.sha256);
  EXPECT_EQ(DigestAt(horizon).sha256, before.sha256);
}

TEST_F(CompactionTest, BadRequestsAreRefused) {
  Open();
  UploadPasses(0, 4);
  EXPECT_EQ(Compact(-1).error().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(service_->Compact({1, "a b"}, Long()).error().code(), StatusCode::kInvalidArgument);
  EXPECT_TRUE(service_->Compact({1, ""}, Long()).has_value());
  for (const FusionPreset preset : {FusionPreset::kStrict, FusionPreset::kPaper}) {
    profile_.preset = preset;
    Open(1, "other" + std::string(FusionPresetName(preset)));
    const auto refused = Compact(kAll_ms);
    EXPECT_EQ(refused.error().code(), StatusCode::kInvalidArgument);
    EXPECT_NE(refused.error().message().find(FusionPresetName(preset)), std::string::npos);
  }
}

TEST_F(CompactionTest, ItEndsInTimeAndWithTheService) {
  Open();
  UploadPasses(0, 4);
  const AtlasDigest before = Digest();
  EXPECT_EQ(Compact(kAll_ms, {}).error().code(), StatusCode::kTimeout);
  std::stop_source gone;
  gone.request_stop();
  EXPECT_EQ(Compact(kAll_ms, {Long().deadline, gone.get_token()}).error().code(),
            StatusCode::kUnavailable);
  service_->EndWaits();
  EXPECT_EQ(Compact(kAll_ms).error().code(), StatusCode::kUnavailable);
  Open();
  EXPECT_EQ(Digest().revision, before.revision);
  EXPECT_EQ(service_->ReadStatus()->counts.compacted, 0u);
}

TEST_F(CompactionTest, DamageIsNamedAndNothingGoes) {
  Open();
  UploadPasses(0, 4);
  Digest();
  Tamper("UPDATE keyframes SET blob = zeroblob(length(blob)) WHERE id = 7");
  Open();
  const auto refused = Compact(kAll_ms);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(refused.error().message().find("bus/pass1/1"), std::string::npos);
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 4 * kKeyframes);
}

TEST_F(CompactionTest, VerifyFindsLostTombstones) {
  Open();
  UploadPasses(0, 4);
  ASSERT_EQ(Compact(kAll_ms)->stored.dropped, kKeyframes);
  EXPECT_EQ(service_->Verify({}, Long())->damaged, 0u);
  Tamper("DELETE FROM tombstones WHERE sequence = 2");
  Open();
  // For its session, its compaction and the count of all.
  EXPECT_EQ(service_->Verify({}, Long())->damaged, 3u);
}

TEST_F(CompactionTest, VerifyFindsALostCompaction) {
  Open();
  UploadPasses(0, 4);
  ASSERT_EQ(Compact(kAll_ms)->stored.dropped, kKeyframes);
  Tamper("DELETE FROM compactions");
  Open();
  const auto report = service_->Verify({}, Long());
  EXPECT_EQ(report->damaged, 1u);
  EXPECT_THAT(report->findings.at(0),
              ::testing::HasSubstr("counter compactions is 1, and the rows say 0"));
}

// A fleet that drives elsewhere does not hold it up.
TEST_F(CompactionTest, UploadsElsewhereKeepNothing) {
  Open();
  UploadPasses(0, 5);
  Digest();
  std::uint32_t sent = 0;
  {
    std::jthread uploads([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        UploadRequest far = PassUpload(10 + sent / kKeyframes, sent % kKeyframes);
        far.pose.x_um += 500'000'000;
        EXPECT_TRUE(Upload(std::move(far)).has_value());
        ++sent;
      }
    });
    while (service_->ReadStatus()->counts.keyframes < 6 * kKeyframes) {
    }
    const auto done = Compact(5 * kPass_ms);
    ASSERT_TRUE(done.has_value()) << done.error().message();
    EXPECT_EQ(done->stored.dropped, 2 * kKeyframes);
    EXPECT_GT(done->stored.revision, 6 * kKeyframes + 1U);
  }
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 3 * kKeyframes + sent);
  ExpectSound();
}

TEST_F(CompactionTest, OneAtATime) {
  Open();
  UploadPasses(0, 5);
  const AtlasDigest before = Digest();
  std::atomic<std::uint64_t> dropped = 0;
  std::atomic<int> refused = 0;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] {
        const auto done = Compact(kAll_ms);
        EXPECT_TRUE(done || done.error().code() == StatusCode::kUnavailable);
        dropped += done ? done->stored.dropped : 0;
        refused += done ? 0 : 1;
      });
    }
  }
  EXPECT_LT(refused, 4);
  EXPECT_EQ(dropped, 2 * kKeyframes);
  EXPECT_EQ(Digest().sha256, before.sha256);
  ExpectSound();
}

// Uploads to the same places keep what is there; nothing else goes wrong.
TEST_F(CompactionTest, UploadsGoOnMeanwhile) {
  Open();
  UploadPasses(0, 5);
  Digest();
  std::uint64_t dropped = 0;
  std::uint32_t sent = 0;
  {
    std::jthread uploads([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        EXPECT_TRUE(Upload(PassUpload(10 + sent / kKeyframes, sent % kKeyframes)).has_value());
        ++sent;
        EXPECT_TRUE(service_->WaitUntilClean(Long()).has_value());
      }
    });
    for (int i = 0; i < 5; ++i) {
      const auto done = Compact(5 * kPass_ms);
      EXPECT_TRUE(done || done.error().code() == StatusCode::kUnavailable);
      dropped += done ? done->stored.dropped : 0;
      EXPECT_EQ(service_->Verify({}, Long())->damaged, 0u);
    }
  }
  const auto last = Compact(5 * kPass_ms);
  ASSERT_TRUE(last.has_value()) << last.error().message();
  dropped += last->stored.dropped;
  EXPECT_EQ(service_->ReadStatus()->counts.compacted, dropped);
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 5 * kKeyframes + sent - dropped);
  ExpectSound();
}

}  // namespace
}  // namespace atlas
