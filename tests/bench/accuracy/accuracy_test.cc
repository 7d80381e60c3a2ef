// Short drives through the whole of front end and fusion against the truth: the bench, reduced. And
// what a map is for: a way back along the drive that made it.
#include <gtest/gtest.h>

#include "core/planning/plan_route.h"
#include "core/planning/tile_source.h"
#include "tests/bench/accuracy/accuracy_score.h"
#include "tests/bench/accuracy/bench_drive.h"

namespace atlas::testing {
namespace {

// Of scans [begin, end), in a map of these and of `before` scans before them.
AccuracyScore Score(std::string_view world,
                    std::size_t begin,
                    std::size_t end,
                    std::size_t before = 0) {
  const SimulatedDrive drive = MakeBenchDrive(world, {}).value();
  TruthOptions options;
  options.begin = begin;
  options.end = end;
  const MapProfile profile;
  const auto keyframes =
      BuildKeyframes(drive, begin - before, end, profile, options.range_m).value();
  return ScoreMap(DriveMap(keyframes, profile), MeasureTruth(drive, Vlp16Sensor(), options),
                  options);
}

double FreeCalledFree(const TraversabilityTable& table) {
  return Share{table.free_free, table.free_free + table.free_occupied + table.free_unknown}.value();
}

// What is measured is the same on every run (0.9954 of the street's surfaces, say): the bounds
// leave room for twice to three times as many errors.
TEST(AccuracyTest, AStreetIsMappedAsItIs) {
  const AccuracyScore score = Score("street", 60, 90);
  EXPECT_GT(score.layers_right.whole, 30000U);
  EXPECT_GT(score.layers_right.value(), 0.991);
  EXPECT_GT(score.layers_real.value(), 0.991);
  EXPECT_GT(score.surfaces_found.value(), 0.991);
  EXPECT_LT(score.altitude_rmse_m(), 0.017);
  EXPECT_GT(score.altitude_within_30mm.value(), 0.94);
  EXPECT_GT(score.moving_gone.whole, 1500U);
  EXPECT_GT(score.moving_gone.value(), 0.998);
  EXPECT_GT(score.static_kept.whole, 3500U);
  EXPECT_GT(score.static_kept.value(), 0.98);
  EXPECT_GT(score.static_kept_nearby.value(), 0.998);
  EXPECT_GT(FreeCalledFree(score.traversability), 0.988);
  EXPECT_LT(score.traversability.occupied_free, 60U);
}

TEST(AccuracyTest, BothRoadsOfAnOverpassAreMapped) {
  const AccuracyScore score = Score("overpass", 48, 73);
  EXPECT_GT(score.layers_right.whole, 35000U);
  EXPECT_GT(score.layers_right.value(), 0.999);
  EXPECT_GT(score.layers_real.value(), 0.999);
  EXPECT_GT(score.surfaces_found.value(), 0.999);
  EXPECT_LT(score.altitude_rmse_m(), 0.006);
  EXPECT_GT(score.altitude_within_30mm.value(), 0.99);
  EXPECT_GT(score.moving_gone.whole, 800U);
  EXPECT_GT(score.moving_gone.value(), 0.998);
  EXPECT_GT(score.static_kept.value(), 0.99);
  EXPECT_GT(FreeCalledFree(score.traversability), 0.98);
}

// Two storeys and the ramp between them.
TEST(AccuracyTest, DecksOfAGarageAreMappedEachForItself) {
  const AccuracyScore score = Score("garage", 100, 140);
  EXPECT_GT(score.layers_right.whole, 35000U);
  EXPECT_GT(score.layers_right.value(), 0.965);
  EXPECT_GT(score.layers_real.value(), 0.978);
  EXPECT_GT(score.surfaces_found.value(), 0.985);
  EXPECT_LT(score.altitude_rmse_m(), 0.036);
  EXPECT_GT(score.altitude_within_30mm.value(), 0.96);
  EXPECT_GT(score.static_kept.whole, 5500U);
  EXPECT_GT(score.static_kept.value(), 0.925);
  EXPECT_GT(score.static_kept_nearby.value(), 0.95);
  EXPECT_GT(FreeCalledFree(score.traversability), 0.98);
}

// One that follows beside the vehicle's track: no wheel of the vehicle clears what it filled. What
// clears it are rays ahead, before it comes; a map that began where it is has too few of them.
TEST(AccuracyTest, ACarThatFollowsLeavesNoTrailOnADeck) {
  const AccuracyScore score = Score("garage_with_car_behind", 100, 140, 20);
  EXPECT_GT(score.moving_gone.whole, 1500U);
  EXPECT_GT(score.moving_gone.value(), 0.99);
  EXPECT_GT(score.static_kept.value(), 0.925);
}

class TilesOfDrive : public TileSource {
 public:
  explicit TilesOfDrive(const DriveMap& map) : map_(map) {}
  Result<const Tile*> Get(const TileId& id) override { return map_.Find(id); }

 private:
  const DriveMap& map_;
};

TEST(AccuracyTest, AGaragesRampsAreOpen) {
  const SimulatedDrive drive = MakeBenchDrive("garage", {}).value();
  const MapProfile profile;
  const DriveMap map(BuildKeyframes(drive, 0, drive.scans(), profile, 20.0).value(), profile);
  TilesOfDrive tiles(map);
  const auto place = [&](std::size_t scan) {
    return drive.sensor_pose(scan).translation().eval();
  };
  PlanRequest request{place(0), place(drive.scans() - 1), {}};
  const auto up = PlanRoute(tiles, profile, request);
  ASSERT_TRUE(up.has_value()) << up.error().message();
  ASSERT_TRUE(up->found);
  double driven_m = 0.0;
  for (std::size_t i = 1; i < drive.scans(); ++i) {
    driven_m += (place(i) - place(i - 1)).norm();
  }
  EXPECT_LT(up->length_m, 1.05 * driven_m);
  request.options.max_slope_deg = 5.0;
  const auto flat = PlanRoute(tiles, profile, request);
  ASSERT_TRUE(flat.has_value()) << flat.error().message();
  EXPECT_FALSE(flat->found);
}

}  // namespace
}  // namespace atlas::testing
