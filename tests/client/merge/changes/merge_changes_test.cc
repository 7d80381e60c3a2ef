// A street on two days: the cars that came and those that left are told, what stayed is not.
#include "client/merge/changes/merge_changes.h"

#include <algorithm>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "tests/client/merge/plan/simulated_session.h"

namespace atlas {
namespace {

using testing::SimulatedSession;

class MergeChangesTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    first_ = Day(1);
    second_ = Day(2);
  }
  static void TearDownTestSuite() {
    first_.reset();
    second_.reset();
  }
  static std::unique_ptr<SimulatedSession> Day(std::uint64_t day) {
    return std::make_unique<SimulatedSession>(
        "day" + std::to_string(day),
        testing::DrivePiece{.seed = 2 * day, .first = 20, .count = 60, .parked_seed = day});
  }

  struct Placed {
    explicit Placed(const SimulatedSession& drive, std::int64_t day)
        : session(drive.session()), read(drive.reader()), truth(drive.truth()) {
      for (MergeKeyframe& keyframe : session.keyframes) keyframe.time_ms += day * 86'400'000;
    }
    PlacedSession Get() const { return {&session, truth, &read}; }
    MergeSession session;
    BlobReader read;
    std::vector<Pose> truth;
  };

  // Cars of `here` that are not in `there`, near the way.
  static std::vector<TruthBox> Only(const SimulatedSession& here, const SimulatedSession& there) {
    std::vector<TruthBox> only;
    for (const TruthBox& box : here.parked()) {
      const Eigen::Vector3d middle = box.T_world_box.translation();
      const bool is_near =
          std::any_of(here.truth().begin(), here.truth().end(),
                      [&](const Pose& p) { return (p.translation() - middle).norm() < 8.0; });
      const bool stays =
          std::any_of(there.parked().begin(), there.parked().end(), [&](const TruthBox& other) {
            return (other.T_world_box.translation() - middle).norm() < 1.0;
          });
      if (is_near && !stays) only.push_back(box);
    }
    return only;
  }

  inline static std::unique_ptr<SimulatedSession> first_;
  inline static std::unique_ptr<SimulatedSession> second_;
};

std::size_t CountAt(const std::vector<MapChange>& changes, ChangeKind kind, const TruthBox& box) {
  return static_cast<std::size_t>(
      std::count_if(changes.begin(), changes.end(), [&](const MapChange& change) {
        const Eigen::Vector2d off = change.center_m - box.T_world_box.translation().head<2>();
        return change.kind == kind && off.norm() < 2.0;
      }));
}

TEST_F(MergeChangesTest, CarsThatCameAndLeftAreTold) {
  const Placed before(*first_, 1);
  const Placed after(*second_, 2);
  ASSERT_TRUE(IsEarlier(before.session, after.session));
  std::size_t tiles = 0;
  const auto changes = ChangesSeenBy(
      after.Get(), {before.Get()}, MapProfile(), {}, [&](const Tile&) { ++tiles; }, nullptr);
  ASSERT_TRUE(changes.has_value()) << changes.error().message();
  EXPECT_GT(tiles, 20U);
  const auto came = Only(*second_, *first_);
  const auto left = Only(*first_, *second_);
  ASSERT_GE(came.size() + left.size(), 3U);
  for (const TruthBox& box : came) EXPECT_GE(CountAt(*changes, ChangeKind::kAppeared, box), 1U);
  for (const TruthBox& box : left) EXPECT_GE(CountAt(*changes, ChangeKind::kVanished, box), 1U);
  EXPECT_LE(changes->size(), came.size() + left.size() + 3);
  for (const MapChange& change : *changes) EXPECT_EQ(change.seen_by, after.session.key);
}

TEST_F(MergeChangesTest, OnTheSameDayThereIsNothing) {
  const Placed before(*first_, 1);
  const Placed again(*first_, 2);
  const auto changes =
      ChangesSeenBy(again.Get(), {before.Get()}, MapProfile(), {}, nullptr, nullptr);
  ASSERT_TRUE(changes.has_value());
  EXPECT_TRUE(changes->empty());
}

TEST_F(MergeChangesTest, WithoutAnEarlierVisitThereIsNothing) {
  const Placed only(*first_, 1);
  const auto changes = ChangesSeenBy(only.Get(), {}, MapProfile(), {}, nullptr, nullptr);
  ASSERT_TRUE(changes.has_value());
  EXPECT_TRUE(changes->empty());
}

TEST_F(MergeChangesTest, ErrorsOfTheReaderAndOfProgressEndIt) {
  const Placed before(*first_, 1);
  Placed after(*second_, 2);
  const auto ended = ChangesSeenBy(
      after.Get(), {before.Get()}, MapProfile(), {}, nullptr,
      [](std::size_t, std::size_t) { return Status(StatusCode::kTimeout, "enough"); });
  ASSERT_FALSE(ended.has_value());
  EXPECT_EQ(ended.error(), Status(StatusCode::kTimeout, "enough"));
  after.read = [](std::size_t) -> Result<Bytes> {
    return Error(StatusCode::kUnavailable, "gone");
  };
  const auto gone = ChangesSeenBy(after.Get(), {before.Get()}, MapProfile(), {}, nullptr, nullptr);
  ASSERT_FALSE(gone.has_value());
  EXPECT_EQ(gone.error().code(), StatusCode::kUnavailable);
}

}  // namespace
}  // namespace atlas
