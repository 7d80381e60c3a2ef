// A short drive through the whole of front end and fusion against the truth: the bench, reduced.
#include <gtest/gtest.h>

#include "tests/bench/accuracy/accuracy_score.h"
#include "tests/bench/accuracy/bench_drive.h"

namespace atlas::testing {
namespace {

AccuracyScore Score(std::string_view world, std::size_t begin, std::size_t end) {
  const SimulatedDrive drive = MakeBenchDrive(world, {}).value();
  TruthOptions options;
  options.begin = begin;
  options.end = end;
  const MapProfile profile;
  const auto keyframes = BuildKeyframes(drive, begin, end, profile, options.range_m).value();
  return ScoreMap(DriveMap(keyframes, profile), MeasureTruth(drive, Vlp16Sensor(), options),
                  options);
}

TEST(AccuracyTest, AStreetIsMappedAsItIs) {
  const AccuracyScore score = Score("street", 60, 90);
  EXPECT_GT(score.layers_right.whole, 20000U);
  EXPECT_GT(score.layers_right.value(), 0.99);
  EXPECT_LT(score.altitude_rmse_m(), 0.03);
  EXPECT_GT(score.static_kept.value(), 0.95);
}

TEST(AccuracyTest, BothRoadsOfAnOverpassAreMapped) {
  const AccuracyScore score = Score("overpass", 48, 73);
  EXPECT_GT(score.layers_right.value(), 0.95);
  EXPECT_LT(score.altitude_rmse_m(), 0.05);
}

}  // namespace
}  // namespace atlas::testing
