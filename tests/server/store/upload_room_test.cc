// How much a vehicle, the store and the disk have room for, and who gives room back.
#include "server/store/upload_room.h"

#include <chrono>
#include <fstream>
#include <optional>
#include <thread>

#include <sys/mount.h>
#include <unistd.h>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

const TileId kA{0, 0, 0};

class UploadRoomTest : public StoreTest {
 protected:
  static NewKeyframe Sized(std::uint32_t sequence,
                           std::size_t bytes,
                           const std::string& vehicle = "bus") {
    NewKeyframe keyframe = MakeKeyframe(sequence, {kA});
    keyframe.key.session.vehicle = vehicle;
    keyframe.blob.assign(bytes, static_cast<std::uint8_t>(sequence));
    return keyframe;
  }
  // kNone: it was taken.
  StatusReason ReasonOf(NewKeyframe keyframe) {
    const auto put = Put(std::move(keyframe));
    if (put) {
      return StatusReason::kNone;
    }
    EXPECT_EQ(put.error().code(), StatusCode::kResourceExhausted) << put.error().message();
    return put.error().reason();
  }
  Result<CompactionResult> Compact(std::vector<std::int64_t> ids) {
    return Await<CompactionResult>([&](auto done) {
      store_->Compact({store_->revision(), 0, std::move(ids), "tester"}, std::move(done));
    });
  }
  void Change(SessionAction action) {
    ASSERT_TRUE(Await<SessionChangeResult>([&](auto done) {
                  store_->ChangeSession({{"bus", "day"}, action, "tester", ""}, std::move(done));
                }).has_value());
  }
  std::uint64_t refused(UploadRefusal why) {
    return store_->ReadRoom().refused[static_cast<std::size_t>(why)];
  }
};

TEST_F(UploadRoomTest, AQuotaIsTakenToTheLastByteByEachVehicle) {
  Open();
  store_->SetUploadLimits({.vehicle_bytes = 10});
  EXPECT_EQ(ReasonOf(Sized(0, 4)), StatusReason::kNone);
  EXPECT_EQ(ReasonOf(Sized(1, 7)), StatusReason::kQuota);
  EXPECT_EQ(ReasonOf(Sized(2, 6)), StatusReason::kNone);
  EXPECT_EQ(ReasonOf(Sized(3, 1)), StatusReason::kQuota);
  NewKeyframe other_day = Sized(4, 1);
  other_day.key.session.session = "night";
  EXPECT_EQ(ReasonOf(other_day), StatusReason::kQuota);
  EXPECT_EQ(ReasonOf(Sized(0, 10, "car")), StatusReason::kNone);
  EXPECT_EQ(ReasonOf(Sized(1, 1, "car")), StatusReason::kQuota);
  EXPECT_EQ(store_->ReadCounts()->keyframes, 3u);
  EXPECT_EQ(store_->ReadCounts()->sessions, 2u);
  EXPECT_EQ(refused(UploadRefusal::kQuota), 4u);
  EXPECT_TRUE(store_->ReadRoom().refusing.ok()) << "others may upload";
  EXPECT_FALSE(store_->ReadWriteFigures().last_refusal.has_value());
  store_->SetUploadLimits({});
  EXPECT_EQ(ReasonOf(Sized(3, 1)), StatusReason::kNone);
}

TEST_F(UploadRoomTest, WhatIsThereIsAcknowledgedWhateverTheLimits) {
  Open();
  ASSERT_TRUE(Put(Sized(0, 5)).has_value());
  for (const UploadLimits& limits :
       {UploadLimits{.vehicle_bytes = 1}, UploadLimits{.store_bytes = 1},
        UploadLimits{.disk_floor_bytes = std::uint64_t{1} << 62U}}) {
    store_->SetUploadLimits(limits);
    const auto again = Put(Sized(0, 5));
    ASSERT_TRUE(again.has_value()) << again.error().message();
    EXPECT_TRUE(again->is_duplicate);
    EXPECT_EQ(Put(Sized(0, 6)).error().code(), StatusCode::kConflict);
    EXPECT_NE(ReasonOf(Sized(1, 5)), StatusReason::kNone);
  }
}

TEST_F(UploadRoomTest, WhatIsStoredCountsAfterReopening) {
  Open();
  ASSERT_TRUE(Put(Sized(0, 6)).has_value());
  ASSERT_TRUE(Put(Sized(1, 3)).has_value());
  ASSERT_TRUE(Put(Sized(0, 2, "car")).has_value());
  Open();
  store_->SetUploadLimits({.vehicle_bytes = 10});
  EXPECT_EQ(ReasonOf(Sized(2, 2)), StatusReason::kQuota);
  EXPECT_EQ(ReasonOf(Sized(2, 1)), StatusReason::kNone);
  EXPECT_EQ(ReasonOf(Sized(1, 8, "car")), StatusReason::kNone);
  EXPECT_EQ(ReasonOf(Sized(2, 1, "car")), StatusReason::kQuota);
}

// The last thing that an upload writes fails, alone or with all of its group.
TEST_F(UploadRoomTest, WhatFailsCountsNothing) {
  for (const char* how : {"ABORT", "ROLLBACK"}) {
    SCOPED_TRACE(how);
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Open();
    ASSERT_TRUE(Put(Sized(0, 4)).has_value());
    Open();
    TamperBeside(std::string("CREATE TRIGGER no_13 BEFORE UPDATE ON counters WHEN new.id = 5 AND "
                             "new.value - old.value = 13 BEGIN SELECT raise(") +
                 how + ", 'no'); END");
    store_->SetUploadLimits({.vehicle_bytes = 30});
    for (int i = 0; i < 3; ++i) {
      EXPECT_FALSE(Put(Sized(1, 13)).has_value());
    }
    EXPECT_EQ(ReasonOf(Sized(2, 26)), StatusReason::kNone);
    EXPECT_EQ(ReasonOf(Sized(3, 1)), StatusReason::kQuota);
  }
}

TEST_F(UploadRoomTest, RetractedKeyframesCountAndDroppedOnesDoNot) {
  Open();
  store_->SetUploadLimits({.vehicle_bytes = 10});
  ASSERT_TRUE(Put(Sized(0, 4)).has_value());
  ASSERT_TRUE(Put(Sized(1, 6)).has_value());
  Change(SessionAction::kRetract);
  EXPECT_EQ(ReasonOf(Sized(2, 4)), StatusReason::kQuota);
  Change(SessionAction::kRestore);
  const auto compacted = Compact({1});
  ASSERT_TRUE(compacted.has_value()) << compacted.error().message();
  EXPECT_EQ(ReasonOf(Sized(2, 5)), StatusReason::kQuota);
  EXPECT_EQ(ReasonOf(Sized(2, 4)), StatusReason::kNone);
  EXPECT_EQ(ReasonOf(Sized(3, 1)), StatusReason::kQuota);
  EXPECT_TRUE(Put(Sized(0, 4))->is_duplicate) << "of one that was dropped";
}

TEST_F(UploadRoomTest, APurgeMakesRoomOfASessionInQuarantine) {
  Open();
  NewKeyframe far = Sized(1, 5);
  far.pose = PoseAt(5'000'000'000);
  far.limits = PlausibilityLimits();
  ASSERT_TRUE(Put(Sized(0, 5)).has_value());
  ASSERT_TRUE(Put(far)->judgement.has_value());
  NewKeyframe next = Sized(0, 1);
  next.key.session.session = "next";
  for (const UploadLimits& limits :
       {UploadLimits{.store_bytes = 1}, UploadLimits{.vehicle_bytes = 10}}) {
    store_->SetUploadLimits(limits);
    const auto refused = Put(next);
    ASSERT_FALSE(refused.has_value());
    EXPECT_NE(refused.error().message().find("atlas session purge"), std::string::npos);
  }
  Change(SessionAction::kPurge);
  EXPECT_EQ(ReasonOf(next), StatusReason::kNone);
}

TEST_F(UploadRoomTest, WhatIsBehindARefusedOneWaitsForIt) {
  Open();
  store_->SetUploadLimits({.vehicle_bytes = 10});
  const auto missing = std::make_shared<MissingUploads>();
  const auto send = [&](std::uint32_t sequence, std::size_t bytes) {
    NewKeyframe keyframe = Sized(sequence, bytes);
    keyframe.missing = missing;
    return Put(std::move(keyframe));
  };
  EXPECT_EQ(send(0, 11).error().reason(), StatusReason::kQuota);
  EXPECT_EQ(send(1, 1).error().code(), StatusCode::kUnavailable);
  store_->SetUploadLimits({.vehicle_bytes = 12});
  EXPECT_TRUE(send(0, 11).has_value());
  EXPECT_TRUE(send(1, 1).has_value());
}

TEST_F(UploadRoomTest, AFullStoreRefusesUploadsAndTakesAllElse) {
  Open();
  std::uint32_t count = 0;
  for (; count < 20; ++count) {
    ASSERT_TRUE(Put(Sized(count, 50'000)).has_value());
  }
  const std::uint64_t used = store_->ReadRoom().used_bytes;
  EXPECT_GT(used, 1'000'000u);
  EXPECT_LT(used, std::filesystem::file_size(Database()) + (1u << 22U));
  store_->SetUploadLimits({.store_bytes = used + 50'000});
  EXPECT_EQ(ReasonOf(Sized(count, 50'000)), StatusReason::kNone) << "to the last byte";
  EXPECT_EQ(ReasonOf(Sized(count + 1, 50'000)), StatusReason::kStoreLimit);
  store_->SetUploadLimits({.store_bytes = used});
  EXPECT_EQ(store_->ReadRoom().refusing.reason(), StatusReason::kStoreLimit);
  EXPECT_EQ(ReasonOf(Sized(count + 1, 1, "car")), StatusReason::kStoreLimit);
  EXPECT_EQ(refused(UploadRefusal::kStoreLimit), 2u);
  EXPECT_EQ(store_->ReadWriteFigures().last_refusal->why.reason(), StatusReason::kStoreLimit);

  EXPECT_TRUE(Update({{{{"bus", "day"}, 1}, PoseAt(5), {kA}}}).has_value());
  EXPECT_TRUE(Finish(Claim().claims.at(0), Content(7)).has_value());
  Change(SessionAction::kRetract);
  Change(SessionAction::kRestore);
  EXPECT_TRUE(store_->ReadKeyframeBlob(1).has_value());
  ASSERT_TRUE(Compact({1, 2, 3}).has_value());
  EXPECT_LT(store_->ReadRoom().used_bytes, used - 50'000);
  EXPECT_TRUE(store_->ReadRoom().refusing.ok());
  EXPECT_EQ(ReasonOf(Sized(count + 1, 50'000)), StatusReason::kNone) << "freed pages are room";
  Open();
  EXPECT_GT(store_->ReadRoom().used_bytes, 1'000'000u) << "known before anything is written";
}

TEST_F(UploadRoomTest, ADiskBelowItsFloorRefusesUploads) {
  Open();
  store_->SetUploadLimits({.disk_floor_bytes = std::uint64_t{1} << 62U});
  EXPECT_EQ(ReasonOf(Sized(0, 5)), StatusReason::kDiskFloor);
  EXPECT_EQ(refused(UploadRefusal::kDiskFloor), 1u);
  EXPECT_EQ(store_->ReadRoom().refusing.reason(), StatusReason::kDiskFloor);
  EXPECT_GT(store_->ReadRoom().free_disk_bytes.value_or(0), 0u);
  EXPECT_EQ(store_->ReadWriteFigures().last_refusal->why.reason(), StatusReason::kDiskFloor);
  store_->SetUploadLimits({.disk_floor_bytes = 1});
  EXPECT_EQ(ReasonOf(Sized(0, 5)), StatusReason::kNone);
  EXPECT_TRUE(store_->ReadRoom().refusing.ok());
}

TEST(UploadRoomLimitsTest, TheFloorItselfIsFreeAndEachRefusalSaysHowLongToWait) {
  std::uint64_t free_bytes = 100;
  UploadRoom room([&] { return Result<std::uint64_t>(free_bytes); });
  room.set_limits({.store_bytes = 50, .vehicle_bytes = 20, .disk_floor_bytes = 100});
  auto now = UploadRoom::Clock::time_point() + std::chrono::hours(1);
  EXPECT_TRUE(room.Check({"bus", 10, 10, 40}, now).ok());
  const Status quota = room.Check({"bus", 10, 11, 40}, now);
  EXPECT_EQ(quota.reason(), StatusReason::kQuota);
  EXPECT_EQ(quota.retry_after_ms(), 60'000);
  EXPECT_EQ(room.Check({"bus", 10, 11, 41}, now).reason(), StatusReason::kStoreLimit);
  free_bytes = 99;
  now += std::chrono::seconds(1);
  const Status refused = room.Check({"bus", 10, 11, 41}, now);
  EXPECT_EQ(refused.reason(), StatusReason::kDiskFloor);
  EXPECT_NE(refused.message().find("retention.disk_floor_mib"), std::string::npos);
  EXPECT_EQ(refused.retry_after_ms(), 10'000);
}

TEST(UploadRoomLimitsTest, ADiskThatDoesNotTellIsNoRoomWhereAFloorIsSet) {
  UploadRoom room(
      [] { return Result<std::uint64_t>(Error(StatusCode::kUnavailable, "no such disk")); });
  const auto now = UploadRoom::Clock::now();
  EXPECT_TRUE(room.Check({"bus", 1, 0, 0}, now).ok());
  EXPECT_FALSE(room.ReadFigures(now).free_disk_bytes.has_value());
  room.set_limits({.disk_floor_bytes = 1});
  EXPECT_EQ(room.Check({"bus", 1, 0, 0}, now), Status(StatusCode::kUnavailable, "no such disk"));
}

TEST(DiskRoomTest, TheSystemIsAskedOnceASecond) {
  std::uint64_t asked = 0;
  DiskRoom room([&] { return Result<std::uint64_t>(++asked); });
  const DiskRoom::Clock::time_point begin{};
  EXPECT_EQ(room.FreeBytes(begin).value(), 1u);
  EXPECT_EQ(room.FreeBytes(begin + milliseconds(999)).value(), 1u);
  EXPECT_EQ(room.FreeBytes(begin + milliseconds(1'000)).value(), 2u);
  EXPECT_EQ(room.FreeBytes(begin + milliseconds(1'999)).value(), 2u);
}

// A file system of its own, for root only.
class SmallDisk {
 public:
  SmallDisk(std::filesystem::path folder, const char* size) : folder_(std::move(folder)) {
    std::filesystem::create_directories(folder_);
    is_mounted_ = ::geteuid() == 0 && ::mount("none", folder_.c_str(), "tmpfs", 0, size) == 0;
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    if (is_mounted_) {
      ::umount2(folder_.c_str(), MNT_DETACH);
    }
  }
  bool is_mounted() const { return is_mounted_; }

 private:
  std::filesystem::path folder_;
  bool is_mounted_ = false;
};

TEST_F(UploadRoomTest, BelowTheFloorReadsGoOnAndUploadsAgainWhenThereIsRoom) {
  const std::filesystem::path mount = directory_ / "disk";
  const SmallDisk disk(mount, "size=64m");
  if (!disk.is_mounted()) {
    GTEST_SKIP() << "needs root and a tmpfs mount";
  }
  options_.directory = mount / "data";
  Open();
  store_->SetUploadLimits({.disk_floor_bytes = 32U << 20U});
  ASSERT_TRUE(Put(Sized(0, 50'000)).has_value());
  std::ofstream(mount / "ballast") << std::string(40U << 20U, 'x');
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  const auto until = [&](bool is_taken, std::uint32_t first) {
    for (std::uint32_t i = first; std::chrono::steady_clock::now() < deadline; ++i) {
      if (Put(Sized(i, 10)).has_value() == is_taken) {
        return true;
      }
      std::this_thread::sleep_for(milliseconds(20));
    }
    return false;
  };
  EXPECT_TRUE(until(false, 1));
  EXPECT_EQ(ReasonOf(Sized(2'000, 10)), StatusReason::kDiskFloor);
  EXPECT_TRUE(store_->ReadKeyframeBlob(1).has_value());
  EXPECT_TRUE(Update({{{{"bus", "day"}, 0}, PoseAt(5), {kA}}}).has_value());
  std::filesystem::remove(mount / "ballast");
  EXPECT_TRUE(until(true, 3'000));
  store_.reset();
}

}  // namespace
}  // namespace atlas
