// A session's keyframes are read once, in order, and what is wrong with one is said of it.
#include "client/merge/plan/submap_builder.h"

#include <cmath>
#include <thread>
#include <utility>

#include <gtest/gtest.h>

#include "core/base/hash.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/client/merge/plan/blind_session.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas {
namespace {

using testing::At;
using testing::Straight;

// Thirty keyframes of a made-up street, three submaps.
class SubmapBuilderTest : public ::testing::Test {
 protected:
  SubmapBuilderTest() : session_(testing::BlindSession("car", Straight(At(0.0), 31))) {
    session_.submaps.clear();
    for (std::size_t i = 0; i < session_.keyframes.size(); ++i) {
      session_.keyframes[i].sequence = static_cast<std::uint32_t>(100 + 2 * i);
      blobs_.push_back(
          EncodeKeyframe(testing::StreetKeyframe(profile_, 30, static_cast<std::uint32_t>(i))));
      session_.keyframes[i].blob_hash = Hash64(blobs_.back());
    }
  }

  MergeContext Context() { return {profile_, options_, work_}; }

  Status Build(MergeSession& session) {
    return BuildSubmaps(
        session, StoredPoses(session), [&](std::size_t i) -> Result<Bytes> { return blobs_[i]; },
        Context(), {}, nullptr);
  }

  Submap::Tiles TilesOf(const MergeSession& session, std::size_t i) const {
    return work_.LoadSubmap(session.submaps[i].sketch.name).value().DecodeTiles(profile_).value();
  }

  void ExpectInvalid(const std::string& name) {
    const Status status = Build(session_);
    EXPECT_EQ(status.code(), StatusCode::kInvalidData);
    EXPECT_NE(status.message().find(name), std::string::npos) << status.message();
  }

  MapProfile profile_;
  MergeOptions options_;
  MergeSession session_;
  std::vector<Bytes> blobs_;
  MergeWork work_ = MergeWork::Temporary().value();
};

TEST_F(SubmapBuilderTest, EachKeyframeIsReadOnceInOrderByTheCaller) {
  std::vector<std::size_t> read;
  std::vector<std::size_t> done;
  options_.workers = 1;  // four submaps at a time
  options_.cut.length_m = 3.0;
  const auto caller = std::this_thread::get_id();
  const Status status = BuildSubmaps(
      session_, StoredPoses(session_),
      [&](std::size_t i) -> Result<Bytes> {
        EXPECT_EQ(std::this_thread::get_id(), caller);
        read.push_back(i);
        return blobs_[i];
      },
      Context(), {},
      [&](std::size_t submaps, std::size_t all) {
        EXPECT_EQ(all, 10U);
        done.push_back(submaps);
        return Status();
      });
  ASSERT_TRUE(status.ok()) << status.message();
  ASSERT_EQ(read.size(), 31U);
  for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(read[i], i);
  EXPECT_EQ(done, (std::vector<std::size_t>{4, 8, 10}));
  EXPECT_EQ(session_.submaps.size(), 10U);
}

TEST_F(SubmapBuilderTest, SubmapsAreTheSameFromAnyNumberOfWorkers) {
  MergeSession other = session_;
  options_.workers = 1;
  ASSERT_TRUE(Build(session_).ok());
  options_.workers = 3;
  const MergeWork first = std::exchange(work_, MergeWork::Temporary().value());
  ASSERT_TRUE(Build(other).ok());
  ASSERT_EQ(other.submaps.size(), session_.submaps.size());
  for (std::size_t i = 0; i < other.submaps.size(); ++i) {
    EXPECT_EQ(other.submaps[i].cut, session_.submaps[i].cut);
    EXPECT_EQ(other.submaps[i].T_world_submap.matrix(),
              session_.submaps[i].T_world_submap.matrix());
    const auto tiles =
        first.LoadSubmap(session_.submaps[i].sketch.name).value().DecodeTiles(profile_).value();
    const auto others = TilesOf(other, i);
    ASSERT_FALSE(tiles.empty());
    ASSERT_EQ(tiles.size(), others.size());
    for (std::size_t k = 0; k < tiles.size(); ++k) EXPECT_EQ(*tiles[k], *others[k]);
  }
}

// Two sessions' lattices do not lie on each other, nor those of neighbours.
TEST_F(SubmapBuilderTest, FramesAreTurnedByWhatTheSessionIsCalled) {
  MergeSession other = session_;
  other.key.vehicle = "van";
  ASSERT_TRUE(Build(session_).ok());
  ASSERT_TRUE(Build(other).ok());
  const auto yaw_of = [](const MergeSubmap& submap) {
    return SplitYaw(Eigen::Quaterniond(submap.T_world_submap.linear())).yaw_rad;
  };
  EXPECT_GT(std::abs(yaw_of(session_.submaps[0]) - yaw_of(other.submaps[0])), 1e-3);
  EXPECT_GT(std::abs(yaw_of(session_.submaps[0]) - yaw_of(session_.submaps[1])), 1e-3);
}

// Fused by other poses, cut by those that are stored: a closure's submap stays the same one.
TEST_F(SubmapBuilderTest, TheCutIsThatOfTheStoredPoses) {
  ASSERT_TRUE(Build(session_).ok());
  std::vector<SubmapCut> cuts;
  for (const MergeSubmap& submap : session_.submaps) cuts.push_back(submap.cut);
  const std::vector<Pose> longer = Straight(At(0.0), 31, 2.0);
  ASSERT_TRUE(BuildSubmaps(
                  session_, longer, [&](std::size_t i) -> Result<Bytes> { return blobs_[i]; },
                  Context(), {}, nullptr)
                  .ok());
  ASSERT_EQ(session_.submaps.size(), cuts.size());
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const MergeSubmap& submap = session_.submaps[i];
    EXPECT_EQ(submap.cut, cuts[i]);
    EXPECT_TRUE(
        submap.T_world_submap.translation().isApprox(longer[submap.middle()].translation()));
    EXPECT_LT(testing::DistanceBetween(StoredPose(session_, submap),
                                       session_.keyframes[submap.middle()].T_world_sensor.ToPose()),
              1e-9);
  }
}

TEST_F(SubmapBuilderTest, ADamagedKeyframeIsNamed) {
  blobs_[17][blobs_[17].size() / 2] ^= 0x10;
  ExpectInvalid("car/drive/134");
}

TEST_F(SubmapBuilderTest, AnotherKeyframeThanItsHashSaysIsNamed) {
  blobs_[17] = blobs_[18];
  ExpectInvalid("car/drive/134");
}

TEST_F(SubmapBuilderTest, ATruncatedKeyframeIsNamed) {
  blobs_[3].resize(10);
  ExpectInvalid("car/drive/106");
}

TEST_F(SubmapBuilderTest, AKeyframeOfAnotherProfileIsNamed) {
  MapProfile other = profile_;
  other.hit_units = 26;
  blobs_[8] = EncodeKeyframe(testing::StreetKeyframe(other, 30, 8));
  session_.keyframes[8].blob_hash = Hash64(blobs_[8]);
  ExpectInvalid("car/drive/116");
}

TEST_F(SubmapBuilderTest, AKeyframeThatIsTiltedIsNamed) {
  Pose tilted = session_.keyframes[5].T_world_sensor.ToPose();
  tilted.rotate(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX()));
  session_.keyframes[5].T_world_sensor = QuantizedPose::FromPose(tilted);
  ExpectInvalid("car/drive/110");
}

TEST_F(SubmapBuilderTest, OfTwoDamagedKeyframesTheFirstIsNamed) {
  blobs_[4].resize(1);
  blobs_[30].resize(1);
  ExpectInvalid("car/drive/108");
}

TEST_F(SubmapBuilderTest, ErrorsOfTheReaderAndOfProgressEndIt) {
  const Status of_reader = BuildSubmaps(
      session_, StoredPoses(session_),
      [&](std::size_t i) -> Result<Bytes> {
        if (i == 20) return Error(StatusCode::kUnavailable, "gone");
        return blobs_[i];
      },
      Context(), {}, nullptr);
  EXPECT_EQ(of_reader, Status(StatusCode::kUnavailable, "gone"));
  const Status of_progress = BuildSubmaps(
      session_, StoredPoses(session_), [&](std::size_t i) -> Result<Bytes> { return blobs_[i]; },
      Context(), {},
      [](std::size_t, std::size_t) { return Status(StatusCode::kTimeout, "enough"); });
  EXPECT_EQ(of_progress, Status(StatusCode::kTimeout, "enough"));
}

TEST_F(SubmapBuilderTest, OfNoKeyframesThereAreNoSubmaps) {
  MergeSession empty;
  EXPECT_TRUE(Build(empty).ok());
  EXPECT_TRUE(empty.submaps.empty());
}

}  // namespace
}  // namespace atlas
