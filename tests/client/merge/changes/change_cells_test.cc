// What stands on one side and not on the other is a change where the other looked, and not where
// it did not, nor where walls are off by centimetres.
#include "client/merge/changes/change_cells.h"

#include <vector>

#include <gtest/gtest.h>

#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::ColumnLayer;
using testing::GroundLayer;
using testing::PaintedMap;

constexpr TileId kTile{0, 0, 0};
const Eigen::Vector3d kMiddle(6.4, 6.4, 0.0);

// A square of road, with a block of obstacles two segments high somewhere.
class Side {
 public:
  Side() = default;

  void Road(int from, int to) {
    from_ = from;
    to_ = to;
  }
  void Block(int x, int y, int cells, double ground_m = 0.0) {
    blocks_.push_back({x, y, cells, ground_m});
  }
  MapWindow Window() const {
    PaintedMap map;
    for (int x = from_; x < to_; ++x) {
      for (int y = from_; y < to_; ++y) map.Put(x, y, LayerAt(x, y));
    }
    return map.Window(kMiddle, 8.0);
  }

 private:
  struct Standing {
    int x;
    int y;
    int cells;
    double ground_m;
  };
  TileLayer LayerAt(int x, int y) const {
    for (const Standing& block : blocks_) {
      const bool is_in =
          x >= block.x && x < block.x + block.cells && y >= block.y && y < block.y + block.cells;
      if (!is_in) continue;
      TileLayer layer = ColumnLayer(block.ground_m, 0b0011);
      layer.flags = TileLayer::kMeasured;  // nothing drives there
      return layer;
    }
    return GroundLayer(0.0);
  }

  std::vector<Standing> blocks_;
  int from_ = 0;
  int to_ = 128;
};

std::vector<StandingCell> Compare(const Side& standing, const Side& other) {
  std::vector<StandingCell> cells;
  AddStandingCells(standing.Window(), other.Window(), kTile, MapProfile(), {}, cells);
  return cells;
}

TEST(ChangeCellsTest, WhatStandsOnARoadThatWasSeenIsAChange) {
  Side after;
  after.Block(40, 50, 10);
  const auto cells = Compare(after, Side());
  ASSERT_EQ(cells.size(), 100U);
  for (const StandingCell& cell : cells) {
    EXPECT_TRUE(cell.cell.x >= 40 && cell.cell.x < 50 && cell.cell.y >= 50 && cell.cell.y < 60);
    EXPECT_FLOAT_EQ(cell.low_m, 0.0F);
    EXPECT_FLOAT_EQ(cell.high_m, 2.0F);
    EXPECT_EQ(cell.segments, 2U);
  }
  EXPECT_TRUE(Compare(Side(), after).empty());
}

TEST(ChangeCellsTest, WhatNobodyLookedAtIsNone) {
  Side after;
  after.Block(40, 50, 10);
  Side before;
  before.Road(60, 128);
  EXPECT_TRUE(Compare(after, before).empty());
}

TEST(ChangeCellsTest, WhatIsOffByAFewCellsIsNone) {
  Side after;
  after.Block(40, 50, 10);
  for (const int off : {-3, -1, 0, 2, 3}) {
    Side before;
    before.Block(40 + off, 50, 10);
    EXPECT_TRUE(Compare(after, before).empty()) << off;
  }
  Side before;
  before.Block(46, 50, 10);
  EXPECT_EQ(Compare(after, before).size(), 30U) << "three cells of ten are further than 0.3 m away";
}

TEST(ChangeCellsTest, OnlyTheTilesOwnCellsAreTold) {
  Side after;
  after.Block(120, 50, 20);  // over the tile's edge
  after.Road(0, 256);
  Side before;
  before.Road(0, 256);
  EXPECT_EQ(Compare(after, before).size(), 160U);
}

StandingCell At(std::int64_t x, std::int64_t y, float low_m = 0.0F) {
  return {{x, y}, low_m, low_m + 2.0F, 2};
}

TEST(ChangeGroupsTest, CellsThatHangTogetherAreOneThing) {
  std::vector<StandingCell> cells;
  for (int i = 0; i < 20; ++i) cells.push_back(At(100, 3 * i));  // a row with gaps
  for (int i = 0; i < 8; ++i) cells.push_back(At(200 + i, -5));
  for (int i = 0; i < 5; ++i) cells.push_back(At(300 + i, 0));  // too small a thing
  const auto changes = GroupCells(cells, ChangeKind::kVanished, 0.1, {});
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_EQ(changes[0].segments, 40U);
  EXPECT_EQ(changes[0].cells.size(), 20U);
  EXPECT_EQ(changes[0].kind, ChangeKind::kVanished);
  EXPECT_NEAR(changes[0].center_m.x(), 10.05, 1e-9);
  EXPECT_NEAR(changes[0].center_m.y(), 2.9, 1e-9);
  EXPECT_NEAR(changes[0].min_m.y(), 0.0, 1e-9);
  EXPECT_NEAR(changes[0].max_m.y(), 5.8, 1e-9);
  EXPECT_EQ(changes[0].low_m, 0.0);
  EXPECT_EQ(changes[0].high_m, 2.0);
  EXPECT_EQ(changes[1].segments, 16U);
}

TEST(ChangeGroupsTest, DecksAboveEachOtherAreApart) {
  std::vector<StandingCell> cells;
  for (int i = 0; i < 10; ++i) {
    cells.push_back(At(i, 0));
    cells.push_back(At(i, 0, 3.0F));
  }
  EXPECT_EQ(GroupCells(cells, ChangeKind::kAppeared, 0.1, {}).size(), 2U);
}

TEST(ChangeGroupsTest, TheirOrderDoesNotMatter) {
  std::vector<StandingCell> cells;
  for (int i = 0; i < 60; ++i) cells.push_back(At((i * 7) % 30, (i * 11) % 40));
  const auto changes = GroupCells(cells, ChangeKind::kAppeared, 0.1, {});
  std::reverse(cells.begin(), cells.end());
  const auto other = GroupCells(cells, ChangeKind::kAppeared, 0.1, {});
  ASSERT_EQ(changes.size(), other.size());
  for (std::size_t i = 0; i < changes.size(); ++i) {
    EXPECT_EQ(changes[i].segments, other[i].segments);
    EXPECT_EQ(changes[i].center_m, other[i].center_m);
  }
}

TEST(ChangeGroupsTest, OfNothingThereIsNothing) {
  EXPECT_TRUE(GroupCells({}, ChangeKind::kAppeared, 0.1, {}).empty());
}

}  // namespace
}  // namespace atlas
