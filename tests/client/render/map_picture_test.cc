#include "client/render/map_picture.h"

#include <map>

#include <gtest/gtest.h>
#include <png.h>
#include <sys/stat.h>
#include <unistd.h>

#include "client/render/color_map.h"
#include "client/render/scale_bar.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

constexpr Rgb kBackground{16, 20, 26};

MapProfile SmallProfile() {
  MapProfile profile;
  profile.tile_cells = 16;
  profile.levels = 3;
  return profile;
}

TileLayer Layer(std::int32_t altitude_mm, std::int8_t occupancy = -30) {
  TileLayer layer;
  layer.altitude_mm = altitude_mm;
  layer.occupancy = occupancy;
  layer.flags = occupancy < 0 ? TileLayer::kTraversable : 0;
  layer.observations = 1;
  return layer;
}

using Cells = std::map<std::pair<int, int>, std::vector<TileLayer>>;  // (x, y) within the tile

Tile MakeTile(const TileId& id, const Cells& cells) {
  const MapProfile profile = SmallProfile();
  Tile tile = EmptyTile(id, profile);
  tile.contributors = {{"car", "monday"}};
  for (int y = 0; y < profile.tile_cells; ++y) {
    for (int x = 0; x < profile.tile_cells; ++x) {
      const auto found = cells.find({x, y});
      if (found != cells.end()) {
        tile.layers.insert(tile.layers.end(), found->second.begin(), found->second.end());
      }
      tile.cell_begin[static_cast<std::size_t>(y * profile.tile_cells + x) + 1] =
          static_cast<std::uint32_t>(tile.layers.size());
    }
  }
  return tile;
}

// Reads levels from tiles that stand for the whole atlas.
LevelReader ReaderOf(const std::vector<Tile>& tiles, std::vector<int>* levels_read = nullptr) {
  return [&tiles, levels_read](std::uint8_t level, const TileCallback& on_tile) -> Status {
    if (levels_read != nullptr) levels_read->push_back(level);
    for (const Tile& tile : tiles) {
      if (tile.id.level == level) ATLAS_RETURN_IF_ERROR(on_tile(tile));
    }
    return {};
  };
}

// Two cells at level 0, four and two cells apart, and their ancestors.
std::vector<Tile> TwoCells() {
  const std::vector<TileLayer> low = {Layer(0)};
  const std::vector<TileLayer> high = {Layer(0), Layer(5490, 40)};
  return {
      MakeTile({2, 0, 0}, {{{0, 0}, high}}),
      MakeTile({1, 0, 0}, {{{0, 0}, low}, {{1, 0}, high}}),
      MakeTile({0, 0, 0}, {{{1, 1}, low}, {{3, 0}, high}}),
  };
}

RenderOptions NoMargin() {
  RenderOptions options;
  options.margin_px = 0;
  options.has_scale_bar = false;
  return options;
}

TEST(MapPictureTest, DrawsTheFinestLevelNorthUp) {
  const std::vector<Tile> tiles = TwoCells();
  const auto picture = RenderMap(ReaderOf(tiles), NoMargin(), SmallProfile());
  ASSERT_TRUE(picture) << picture.error().message();
  EXPECT_DOUBLE_EQ(picture->metres_per_pixel, 0.1);
  ASSERT_EQ(picture->image.width, 3U);
  ASSERT_EQ(picture->image.height, 2U);
  EXPECT_NE(picture->image.at(0, 0), kBackground);  // (1, 1): west and north
  EXPECT_NE(picture->image.at(2, 1), kBackground);  // (3, 0): east and south
  EXPECT_EQ(picture->image.at(1, 0), kBackground);
  EXPECT_EQ(picture->image.at(0, 1), kBackground);
}

TEST(MapPictureTest, MarginSurroundsTheMap) {
  const std::vector<Tile> tiles = TwoCells();
  RenderOptions options;
  options.margin_px = 5;
  options.has_scale_bar = false;
  const auto picture = RenderMap(ReaderOf(tiles), options, SmallProfile());
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->image.width, 13U);
  EXPECT_EQ(picture->image.at(4, 5), kBackground);
  EXPECT_NE(picture->image.at(5, 5), kBackground);
}

TEST(MapPictureTest, LargePicturesTakeACoarserLevel) {
  std::vector<Tile> tiles;
  for (int level = 0; level < 3; ++level) {
    const int last = 40 >> level;
    for (const int cell : {0, last}) {
      tiles.push_back(MakeTile({static_cast<std::uint8_t>(level), cell / 16, 0},
                               {{{cell % 16, 0}, {Layer(0)}}}));
    }
  }
  const auto width_for = [&tiles](std::int64_t max_side_px) {
    RenderOptions options = NoMargin();
    options.max_side_px = max_side_px;
    return RenderMap(ReaderOf(tiles), options, SmallProfile())->image.width;
  };
  EXPECT_EQ(width_for(41), 41U);
  EXPECT_EQ(width_for(40), 21U);
  EXPECT_EQ(width_for(11), 11U);
  EXPECT_EQ(width_for(10), 6U);  // coarser than the pyramid
}

TEST(MapPictureTest, FinerLevelsThatCannotFitAreNotRead) {
  std::vector<Tile> tiles = {MakeTile({2, 0, 0}, {{{0, 0}, {Layer(0)}}}),
                             MakeTile({2, 100, 0}, {{{0, 0}, {Layer(0)}}})};
  RenderOptions options = NoMargin();
  options.max_side_px = 2000;
  std::vector<int> levels;
  const auto picture = RenderMap(ReaderOf(tiles, &levels), options, SmallProfile());
  ASSERT_TRUE(picture);
  EXPECT_EQ(levels, (std::vector<int>{2, 2}));
  EXPECT_EQ(picture->image.width, 1601U);
}

TEST(MapPictureTest, LayerChoicePicksTheSurface) {
  const std::vector<TileLayer> layers = {Layer(0), Layer(3000), Layer(6000)};
  EXPECT_EQ(LayerChoice::Parse("lowest")->Pick(layers)->altitude_mm, 0);
  EXPECT_EQ(LayerChoice::Parse("highest")->Pick(layers)->altitude_mm, 6000);
  EXPECT_EQ(LayerChoice::Parse("1")->Pick(layers)->altitude_mm, 3000);
  EXPECT_EQ(LayerChoice::Parse("3")->Pick(layers), nullptr);
  EXPECT_FALSE(LayerChoice::Parse("-1"));
  EXPECT_FALSE(LayerChoice::Parse("top"));
  EXPECT_FALSE(LayerChoice::Parse(""));
}

TEST(MapPictureTest, MissingLayerIsBlankButKeepsTheFrame) {
  const std::vector<Tile> tiles = TwoCells();
  RenderOptions options = NoMargin();
  options.layer = *LayerChoice::Parse("1");
  const auto picture = RenderMap(ReaderOf(tiles), options, SmallProfile());
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->image.width, 3U);
  EXPECT_EQ(picture->image.at(0, 0), kBackground);
  EXPECT_NE(picture->image.at(2, 1), kBackground);
}

TEST(MapPictureTest, EveryColourTellsItsCellsApart) {
  std::vector<Tile> tiles = TwoCells();
  for (Tile& tile : tiles) {
    tile.layers.back().column = 0xCC;  // two segments occupied
  }
  for (const char* name : {"height", "occupancy", "layers", "columns"}) {
    RenderOptions options = NoMargin();
    options.color = *ParseMapColor(name);
    const auto picture = RenderMap(ReaderOf(tiles), options, SmallProfile());
    ASSERT_TRUE(picture) << name;
    EXPECT_NE(picture->image.at(0, 0), picture->image.at(2, 1)) << name;
  }
  EXPECT_FALSE(ParseMapColor("pink"));
}

TEST(MapPictureTest, EmptyAtlasIsNotFound) {
  const auto picture = RenderMap(ReaderOf({}), NoMargin(), SmallProfile());
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().code(), StatusCode::kNotFound);
}

TEST(MapPictureTest, FailingReaderIsReported) {
  const LevelReader broken = [](std::uint8_t, const TileCallback&) {
    return Status(StatusCode::kUnavailable, "gone");
  };
  EXPECT_EQ(RenderMap(broken, NoMargin(), SmallProfile()).error().code(), StatusCode::kUnavailable);
}

TEST(ColorMapTest, BrightnessGrowsWithHeight) {
  const auto luma = [](const Rgb& c) {
    return 0.3 * c.red + 0.59 * c.green + 0.11 * c.blue;
  };
  for (int i = 0; i < 20; ++i) {
    EXPECT_LT(luma(HeightColor(i / 20.0)), luma(HeightColor((i + 1) / 20.0))) << i;
    EXPECT_LT(luma(ColumnColor(i / 20.0)), luma(ColumnColor((i + 1) / 20.0))) << i;
  }
  EXPECT_EQ(HeightColor(-3.0), HeightColor(0.0));
  EXPECT_EQ(HeightColor(7.0), HeightColor(1.0));
}

TEST(ScaleBarTest, LengthsAreRoundAndFit) {
  EXPECT_DOUBLE_EQ(RoundBarLength(0.1, 200), 20.0);
  EXPECT_DOUBLE_EQ(RoundBarLength(0.1, 199), 10.0);
  EXPECT_DOUBLE_EQ(RoundBarLength(0.2, 60), 10.0);
  EXPECT_DOUBLE_EQ(RoundBarLength(12.8, 200), 2000.0);
}

TEST(ScaleBarTest, IsAsLongAsItSays) {
  Image image{300, 40, std::vector<Rgb>(300 * 40)};
  DrawScaleBar(0.1, 12, image);
  std::uint32_t length_px = 0;
  while (image.at(12 + length_px, 33) != Rgb{}) {
    ++length_px;
  }
  EXPECT_EQ(length_px, 100U);  // 10 m
  Image tiny{8, 8, std::vector<Rgb>(64)};
  DrawScaleBar(0.1, 0, tiny);
  EXPECT_EQ(tiny.pixels, std::vector<Rgb>(64));
}

class PngTest : public testing::Test {
 protected:
  PngTest()
      : folder_(
            std::filesystem::path(testing::TempDir()) /
            (std::string("png_") + testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~PngTest() override { std::filesystem::remove_all(folder_); }
  PngTest(const PngTest&) = delete;
  PngTest& operator=(const PngTest&) = delete;
  PngTest(PngTest&&) = delete;
  PngTest& operator=(PngTest&&) = delete;

  std::filesystem::path folder_;
};

TEST_F(PngTest, ReadsBackPixelForPixel) {
  Image image{3, 2, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}, {13, 14, 15}, {255, 0, 128}}};
  const auto path = folder_ / "a.png";
  ASSERT_TRUE(WritePng(image, path).ok());
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&png, path.c_str()), 0);
  png.format = PNG_FORMAT_RGB;
  ASSERT_EQ(png.width, 3U);
  ASSERT_EQ(png.height, 2U);
  std::vector<Rgb> pixels(6);
  ASSERT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0);
  EXPECT_EQ(pixels, image.pixels);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

TEST_F(PngTest, MissingFolderIsNotFoundAndLeavesNothing) {
  const Image image{1, 1, {{1, 2, 3}}};
  const Status status = WritePng(image, folder_ / "no" / "a.png");
  EXPECT_EQ(status.code(), StatusCode::kNotFound);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace atlas
