// A keyframe that is corrected between the moment in which somebody looks where it lies, to repair
// it, and the one in which it is repaired.
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

const TileId kBefore{0, 0, 0};
const TileId kBehind{0, 7, 0};

class MovedKeyframesTest : public StoreTest {
 protected:
  RepairOutcome Repair(std::int64_t x_um, const TileId& tile) {
    KeyframeRepair repair{1, "tester", std::vector<TileId>{tile}, true};
    repair.pose = PoseAt(x_um);
    const auto outcome = Await<RepairOutcome>(
        [&](auto done) { store_->RepairKeyframe(std::move(repair), std::move(done)); });
    EXPECT_TRUE(outcome) << outcome.error().message();
    return *outcome;
  }
};

TEST_F(MovedKeyframesTest, KeepTheListOfTilesOfTheirPose) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kBefore})));
  Tamper("UPDATE pose_history SET author = 'x'");  // where it was once
  Open();
  ASSERT_TRUE(Update({{{{"bus", "day"}, 1}, PoseAt(700'000), {kBehind}}}));
  EXPECT_EQ(Repair(0, kBefore), RepairOutcome::kDamaged) << "it is not there any more";
  EXPECT_EQ(Repair(700'000, kBehind), RepairOutcome::kRestored);
  EXPECT_EQ(store_->ReadKeyframe(1)->footprint, std::vector<TileId>{kBehind});
}

// Where the list is damaged, too, nothing of it is given up for that.
TEST_F(MovedKeyframesTest, AreNotGivenUpForIt) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kBefore})));
  ASSERT_TRUE(Update({{{{"bus", "day"}, 1}, PoseAt(700'000), {kBehind}}}));
  Tamper("UPDATE keyframe_tiles SET checksum = checksum + 1");
  Open();
  EXPECT_EQ(Repair(0, kBefore), RepairOutcome::kDamaged);
  EXPECT_EQ(Repair(700'000, kBehind), RepairOutcome::kRestored);
}

}  // namespace
}  // namespace atlas
