// Columns drawn by hand and where their points lie.
#include "core/tile/column_points.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

class ColumnPointsTest : public ::testing::Test {
 protected:
  ColumnPointsTest() {
    profile_.cell_size_um = 200'000;
    profile_.tile_cells = 16;
    profile_.segment_height_mm = 500;
    profile_.column_segments = 4;
    profile_.column_base_offset_mm = 300;
  }

  // `layers` in the cell (x, y) and nothing elsewhere.
  Tile WithCell(const TileId& id,
                std::size_t x,
                std::size_t y,
                std::vector<TileLayer> layers) const {
    Tile tile = EmptyTile(id, profile_);
    const std::size_t cell = y * profile_.tile_cells + x;
    for (std::size_t i = cell + 1; i < tile.cell_begin.size(); ++i) {
      tile.cell_begin[i] = static_cast<std::uint32_t>(layers.size());
    }
    tile.layers = std::move(layers);
    return tile;
  }

  static TileLayer Layer(std::int32_t altitude_mm, std::uint64_t column) {
    TileLayer layer;
    layer.altitude_mm = altitude_mm;
    layer.column = column;
    return layer;
  }

  MapProfile profile_;
};

TEST_F(ColumnPointsTest, OccupiedSegmentsAreTheirMiddles) {
  const Tile tile = WithCell({0, 1, -1}, 2, 3, {Layer(130, 0xF189)});
  // Lowest first: 9, 8 (unknown), 1 (free), 15; the lowest covers the height 0.43 m.
  const std::vector<ColumnPoint> expected{{{3.7, -2.5, 0.25}, 9}, {{3.7, -2.5, 1.75}, 15}};
  const std::vector<ColumnPoint> points = DecodeColumns(tile, profile_);
  ASSERT_EQ(points.size(), 2U);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_TRUE(points[i].p_world.isApprox(expected[i].p_world, 1e-12)) << i;
    EXPECT_EQ(points[i].state, expected[i].state) << i;
  }
}

TEST_F(ColumnPointsTest, LayersBelowZeroStandOnTheirOwnLattice) {
  const Tile tile = WithCell({0, 0, 0}, 0, 0, {Layer(-2'400, 0xA), Layer(5'000, 0xB)});
  const std::vector<ColumnPoint> points = DecodeColumns(tile, profile_);
  ASSERT_EQ(points.size(), 2U);
  EXPECT_DOUBLE_EQ(points[0].p_world.z(), -2.25);  // -2.1 m is in [-2.5, -2)
  EXPECT_DOUBLE_EQ(points[1].p_world.z(), 5.25);
}

TEST_F(ColumnPointsTest, TheLeastStateIsTheCallers) {
  const Tile tile = WithCell({0, 0, 0}, 0, 0, {Layer(0, 0xF901)});
  EXPECT_EQ(DecodeColumns(tile, profile_, 10).size(), 1U);
  EXPECT_EQ(DecodeColumns(tile, profile_, 1).size(), 3U);
  EXPECT_EQ(DecodeColumns(tile, profile_, 0).size(), 3U) << "no data is no point";
}

TEST_F(ColumnPointsTest, CoarserTilesHaveLargerCells) {
  const Tile tile = WithCell({2, -1, 1}, 15, 0, {Layer(0, 0x9)});
  const std::vector<ColumnPoint> points = DecodeColumns(tile, profile_);
  ASSERT_EQ(points.size(), 1U);
  EXPECT_TRUE(points[0].p_world.isApprox(Eigen::Vector3d(-0.4, 13.2, 0.25), 1e-12));
}

TEST_F(ColumnPointsTest, AnEmptyTileHasNone) {
  EXPECT_TRUE(DecodeColumns(EmptyTile({0, 0, 0}, profile_), profile_).empty());
}

}  // namespace
}  // namespace atlas
