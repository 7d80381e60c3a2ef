// Kerbs drawn by hand: which cells they are and what is said of them.
#include "client/score/curb_score.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr std::uint32_t kRoad = 40;
constexpr std::uint32_t kParking = 44;
constexpr std::uint32_t kSidewalk = 48;
constexpr std::uint32_t kCar = 10;

// A row of returns at x = 10.05 m, a cell each from y = 0 on.
struct Row {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint32_t> labels;
  std::vector<JudgedReturn> judged;

  void Add(int cell, std::uint32_t label, bool is_called_ground) {
    judged.push_back({static_cast<std::uint32_t>(points.size()), is_called_ground});
    points.emplace_back(10.05F, 0.1F * static_cast<float>(cell) + 0.05F, -1.7F);
    labels.push_back(label);
  }
  CurbCounts Count() const {
    CurbCounts counts;
    CountCurbs(points, labels, judged, counts);
    return counts;
  }
};

TEST(CurbScoreTest, CellsWithinOneOfBothSidesAreKerbTheRestIsRoad) {
  Row row;
  for (const int cell : {0, 1, 2, 3}) row.Add(cell, kRoad, true);
  for (const int cell : {4, 5, 6}) row.Add(cell, kSidewalk, true);
  const CurbCounts counts = row.Count();
  EXPECT_EQ(counts.curb_cells, 2U);  // 3 and 4
  EXPECT_EQ(counts.missed_curb_cells, 2U);
  EXPECT_EQ(counts.road_cells, 3U);
  EXPECT_EQ(counts.false_road_cells, 0U);
}

TEST(CurbScoreTest, ParkingIsRoadAndRatesAreShares) {
  Row row;
  for (const int cell : {0, 1, 2}) row.Add(cell, kParking, cell != 0);
  row.Add(3, kSidewalk, false);
  row.Add(2, kParking, false);
  row.Add(2, kParking, false);
  const CurbCounts counts = row.Count();
  EXPECT_EQ(counts.missed_curb(), 0.0);  // 2: one of three, 3: none
  EXPECT_EQ(counts.false_road(), 0.5);   // 0 of {0, 1}
}

TEST(CurbScoreTest, AHalfIsNotMost) {
  Row row;
  row.Add(0, kRoad, true);
  row.Add(0, kRoad, false);
  EXPECT_EQ(row.Count().false_road_cells, 1U);
}

TEST(CurbScoreTest, IrrelevantReturnsDoNotCount) {
  Row row;
  row.Add(0, kRoad, true);
  for (int i = 0; i < 5; ++i) row.Add(0, kCar, false);
  row.Add(3, kCar, false);
  const CurbCounts counts = row.Count();
  EXPECT_EQ(counts.road_cells, 1U);
  EXPECT_EQ(counts.false_road_cells, 0U);
}

TEST(CurbScoreTest, KerbsAreFoundFromAllReturnsButJudgedByThoseUsed) {
  Row row;
  row.Add(0, kRoad, true);
  row.Add(1, kSidewalk, true);
  row.judged.pop_back();  // a ring that is left out
  const CurbCounts counts = row.Count();
  EXPECT_EQ(counts.curb_cells, 1U);
  EXPECT_EQ(counts.road_cells, 0U);
}

TEST(CurbScoreTest, OfNoCellsThereIsNoShare) {
  EXPECT_EQ(Row().Count().missed_curb(), std::nullopt);
  EXPECT_EQ(Row().Count().false_road(), std::nullopt);
}

}  // namespace
}  // namespace atlas
