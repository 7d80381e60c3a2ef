#include "core/tile/tile_pyramid.h"

#include <gtest/gtest.h>

#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"
#include "tests/core/support/test_scale.h"
#include "tests/core/support/tile_worlds.h"

namespace atlas {
namespace {

constexpr std::uint8_t kFree = TileLayer::kTraversable | TileLayer::kTraversableAny;
constexpr std::uint8_t kMeasured = TileLayer::kMeasured;

MapProfile SmallProfile() {
  MapProfile profile;
  profile.tile_cells = 16;
  return profile;
}

TileLayer Layer(std::int32_t altitude_mm, std::uint8_t flags = kFree | kMeasured) {
  return {altitude_mm, 200, -20, flags, 10, 0};
}

// A tile with the given layers in its first 2 x 2 cells: (0,0), (1,0), (0,1), (1,1).
Tile FourCells(const std::array<std::vector<TileLayer>, 4>& cells) {
  Tile tile = EmptyTile({0, 0, 0}, SmallProfile());
  tile.contributors = {{"car", "drive"}};
  const std::array<std::size_t, 4> index{0, 1, 16, 17};
  std::size_t next = 0;
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    if (next < 4 && cell == index[next]) {
      tile.layers.insert(tile.layers.end(), cells[next].begin(), cells[next].end());
      ++next;
    }
    tile.cell_begin[cell + 1] = static_cast<std::uint32_t>(tile.layers.size());
  }
  return tile;
}

// The layers of the one parent cell above them.
std::vector<TileLayer> ParentCell(const std::array<std::vector<TileLayer>, 4>& cells) {
  const Tile child = FourCells(cells);
  const Tile parent =
      BuildParentTile({1, 0, 0}, {&child, nullptr, nullptr, nullptr}, SmallProfile());
  EXPECT_EQ(parent.layers.size(), parent.Layers(0).size());
  EXPECT_TRUE(DecodeTile(EncodeTile(parent, SmallProfile()).blob, SmallProfile()).has_value());
  return {parent.layers.begin(), parent.layers.end()};
}

TEST(TilePyramidTest, IsEmptyWhenEveryChildIs) {
  const Tile empty = EmptyTile({0, 0, 0}, SmallProfile());
  const Tile parent =
      BuildParentTile({1, 0, 0}, {&empty, nullptr, &empty, nullptr}, SmallProfile());
  EXPECT_TRUE(parent.is_empty());
  EXPECT_TRUE(parent.contributors.empty());
  EXPECT_EQ(parent.id, (TileId{1, 0, 0}));
}

TEST(TilePyramidTest, AltitudesCombineByInformation) {
  TileLayer sure = Layer(100);
  TileLayer unsure = Layer(200);
  sure.sigma_100um = 100;
  unsure.sigma_100um = 300;
  const auto layers = ParentCell({{{sure}, {unsure}, {}, {}}});
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].altitude_mm, 110);  // weights 9 : 1
  EXPECT_EQ(layers[0].sigma_100um, 96u);  // 100 / sqrt(1 + 1/9), rounded
}

TEST(TilePyramidTest, TraversableNeedsAllFourChildrenAnyNeedsOne) {
  const auto all = ParentCell({{{Layer(0)}, {Layer(9)}, {Layer(5)}, {Layer(0)}}});
  EXPECT_EQ(all[0].flags, kFree | kMeasured);
  const auto obstacle = ParentCell({{{Layer(0)}, {Layer(0)}, {Layer(0)}, {Layer(0, 0)}}});
  EXPECT_EQ(obstacle[0].flags, TileLayer::kTraversableAny | kMeasured);
  const auto unseen = ParentCell({{{Layer(0)}, {Layer(0)}, {Layer(0)}, {}}});
  EXPECT_EQ(unseen[0].flags, TileLayer::kTraversableAny | kMeasured);
  const auto none = ParentCell({{{Layer(0, 0)}, {Layer(0, 0)}, {}, {}}});
  EXPECT_EQ(none[0].flags, 0);
}

TEST(TilePyramidTest, OccupancyByMaximumObservationsByMinimum) {
  TileLayer wall = Layer(0, 0);
  wall.occupancy = 30;
  wall.observations = 4;
  const auto layers = ParentCell({{{Layer(0)}, {wall}, {Layer(0)}, {Layer(0)}}});
  EXPECT_EQ(layers[0].occupancy, 30);
  EXPECT_EQ(layers[0].observations, 4);
}

TEST(TilePyramidTest, DecksStayApartAndRampsJoin) {
  const auto decks =
      ParentCell({{{Layer(0), Layer(5'500)}, {Layer(20), Layer(5'480)}, {Layer(10)}, {}}});
  ASSERT_EQ(decks.size(), 2u);
  EXPECT_NEAR(decks[0].altitude_mm, 10, 1);
  EXPECT_NEAR(decks[1].altitude_mm, 5'490, 1);
  EXPECT_EQ(decks[1].flags & TileLayer::kTraversable, 0);  // only two of its four cells exist
  const auto ramp = ParentCell({{{Layer(0)}, {Layer(60)}, {Layer(120)}, {Layer(180)}}});
  EXPECT_EQ(ramp.size(), 1u);
}

TEST(TilePyramidTest, ColumnsCombineByMaximumOnTheCommonLattice) {
  // Segments are 1 m, the base offset 0.3 m: bases at indices 0 and 1.
  TileLayer low = Layer(600);
  TileLayer high = Layer(750);
  low.column = 0x00000F31;   // indices 0, 1, 2
  high.column = 0x00000025;  // indices 1, 2
  const auto layers = ParentCell({{{low}, {high}, {}, {}}});
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].altitude_mm, 675);
  EXPECT_EQ(ColumnBaseIndex(675, SmallProfile()), 0);
  EXPECT_EQ(layers[0].column, 0x0000'0F51u);  // index 1: max(3, 5), index 2: max(15, 2)

  // Seen from a higher base the lowest segment is gone; empty children add nothing.
  low.sigma_100um = 2'000;
  const auto rebased = ParentCell({{{low}, {high}, {Layer(750)}, {}}});
  EXPECT_EQ(ColumnBaseIndex(rebased[0].altitude_mm, SmallProfile()), 1);
  EXPECT_EQ(rebased[0].column, 0x0000'00F5u);
}

TEST(TilePyramidTest, ColumnsEndBelowTheParentsNextDeck) {
  TileLayer open = Layer(0);
  open.column = 0xFFFFFFFF;
  const auto layers = ParentCell({{{open}, {Layer(0), Layer(5'500)}, {}, {}}});
  ASSERT_EQ(layers.size(), 2u);
  EXPECT_EQ(layers[0].column, 0x0000'FFFFu);  // wholly below 5.5 m - 0.7 m
}

TEST(TilePyramidTest, EachQuadrantComesFromItsChild) {
  const MapProfile profile = SmallProfile();
  std::array<Tile, 4> tiles;
  std::array<const Tile*, 4> children{};
  for (std::size_t i = 0; i < 4; ++i) {
    std::vector<TileLayer> cell{Layer(static_cast<std::int32_t>(1'000 * i))};
    tiles[i] = FourCells({cell, cell, cell, cell});
    tiles[i].contributors = {{"car", StrCat("drive", i % 2)}};
    children[i] = &tiles[i];
  }
  const Tile parent = BuildParentTile({1, 0, 0}, children, profile);
  ASSERT_EQ(parent.layers.size(), 4u);
  EXPECT_EQ(parent.Layers(0)[0].altitude_mm, 0);
  EXPECT_EQ(parent.Layers(8)[0].altitude_mm, 1'000);
  EXPECT_EQ(parent.Layers(8 * 16)[0].altitude_mm, 2'000);
  EXPECT_EQ(parent.Layers(8 * 16 + 8)[0].altitude_mm, 3'000);
  EXPECT_EQ(parent.contributors, (std::vector<SessionKey>{{"car", "drive0"}, {"car", "drive1"}}));
}

TEST(TilePyramidTest, RandomPyramidsStayValid) {
  const MapProfile profile = SmallProfile();
  for (std::uint32_t seed = 0; seed < testing::Scaled(20); ++seed) {
    const Tile a = testing::RandomTile({0, 0, 0}, profile, seed);
    const Tile b = testing::RandomTile({0, 1, 0}, profile, seed + 100);
    const Tile parent = BuildParentTile({1, 0, 0}, {&a, &b, nullptr, &a}, profile);
    const auto decoded = DecodeTile(EncodeTile(parent, profile).blob, profile);
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message();
    EXPECT_EQ(*decoded, parent);
  }
}

}  // namespace
}  // namespace atlas
