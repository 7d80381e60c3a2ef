// An atlas file as a source of a map: the same tiles that its daemon would send.
#include "client/atlas_file/atlas_file.h"

#include <fstream>
#include <set>

#include <gtest/gtest.h>

#include "client/map/cell_address.h"
#include "client/map/map_view.h"
#include "tests/client/atlas_file/tiny_atlas_file.h"

namespace atlas {
namespace {

TinyWorld SquareWorld(int side) {
  TinyWorld world;
  for (int x = -1; x < side - 1; ++x) {
    for (int y = -1; y < side - 1; ++y) {
      world.Set(x, y, 100 * x + y + 500);
    }
  }
  return world;
}

AtlasFile Opened(const TinyAtlasFile& file) {
  auto opened = AtlasFile::Open(file.path());
  if (!opened) throw std::runtime_error(opened.error().message());
  return *std::move(opened);
}

std::set<TileId> IdsOf(AtlasFile& file, std::uint8_t level, std::optional<DiscArea> disc) {
  std::set<TileId> ids;
  const Status status = file.ReadLevel(level, disc, [&ids](const TileBlob& tile) {
    EXPECT_TRUE(ids.insert(tile.id).second) << tile.id;
    return Status();
  });
  EXPECT_TRUE(status.ok()) << status.message();
  return ids;
}

TEST(AtlasFileTest, HasTheTilesOfItsDaemon) {
  const TinyWorld world = SquareWorld(4);
  TinyAtlasFile written;
  written.Write(world);
  AtlasFile file = Opened(written);
  EXPECT_EQ(file.key(), TinyAtlas());
  EXPECT_EQ(file.revision(), written.revision());
  EXPECT_EQ(file.dirty_tiles(), 0U);
  for (const auto& [id, stored] : world.tiles()) {
    const auto tile = file.Read(id);
    ASSERT_TRUE(tile && *tile) << id;
    EXPECT_EQ((*tile)->blob, stored.encoded.blob);
    EXPECT_EQ((*tile)->payload_hash, stored.encoded.payload_hash);
  }
  EXPECT_EQ(*file.Read({0, 100, 100}), std::nullopt);
  EXPECT_EQ(IdsOf(file, 0, std::nullopt).size(), 16U);
}

TEST(AtlasFileTest, ADiscHasTheTilesThatItTouches) {
  TinyAtlasFile written;
  written.Write(SquareWorld(6));
  AtlasFile file = Opened(written);
  for (const double radius_m : {0.0, 0.5, 1.6, 2.9, 100.0}) {
    for (const Eigen::Vector2d& center_m :
         {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(0.8, 2.4), Eigen::Vector2d(-3.0, 1.6)}) {
      const auto touched = *TilesInDisc(center_m, radius_m, 0, TinyProfile(), 1'000'000);
      const std::set<TileId> read = IdsOf(file, 0, DiscArea{center_m, radius_m});
      for (const TileId& id : touched) {
        const bool is_there = *file.Read(id) != std::nullopt;
        EXPECT_EQ(read.contains(id), is_there) << id << ' ' << radius_m;
      }
    }
  }
}

TEST(AtlasFileTest, IsAMapForAView) {
  TinyAtlasFile written;
  written.Write(SquareWorld(3));
  AtlasFile file = Opened(written);
  MapView view(file);
  ASSERT_TRUE(view.Load({0.8, 0.8}, 10.0, 0).ok());
  EXPECT_EQ(view.tiles_loaded(), 9U);
  const auto tile = view.Get({0, 1, 0});
  ASSERT_TRUE(tile && *tile);
  EXPECT_EQ((*tile)->layers.front().altitude_mm, 610);
  EXPECT_EQ(*view.Get({0, 50, 0}), nullptr);
  EXPECT_TRUE(view.LayersAt({500.0, 500.0})->empty());
}

TEST(AtlasFileTest, TellsWhatIsNotFusedYet) {
  const TinyWorld world = SquareWorld(2);
  TinyAtlasFile written;
  written.Write(world);
  written.Mark(world);
  AtlasFile file = Opened(written);
  EXPECT_EQ(file.dirty_tiles(), 4U);
  EXPECT_EQ(IdsOf(file, 0, std::nullopt).size(), 4U);  // as they were
}

TEST(AtlasFileTest, TellsWhetherItHasATileAtAll) {
  TinyAtlasFile written;
  {
    AtlasFile file = Opened(written);
    EXPECT_FALSE(file.HasTiles().value());
  }
  written.Write(SquareWorld(1));
  written.Damage({0, -1, -1});
  EXPECT_TRUE(Opened(written).HasTiles().value());
}

TEST(AtlasFileTest, ADamagedTileEndsAReadingAndIsNamed) {
  TinyAtlasFile written;
  written.Write(SquareWorld(2));
  written.Damage({0, 0, 0});
  AtlasFile file = Opened(written);
  const Status status = file.ReadLevel(0, std::nullopt, [](const TileBlob&) { return Status(); });
  EXPECT_EQ(status.code(), StatusCode::kInvalidData);
  EXPECT_NE(status.message().find("tile 0/0/0"), std::string::npos) << status.message();
  MapView view(file);
  EXPECT_TRUE(view.Get({0, -1, 0}));
  EXPECT_EQ(view.Get({0, 0, 0}).error().code(), StatusCode::kInvalidData);
}

TEST(AtlasFileTest, WhatMakesNoSenseIsRefused) {
  TinyAtlasFile written;
  written.Write(SquareWorld(2));
  AtlasFile file = Opened(written);
  const auto ignore = [](const TileBlob&) {
    return Status();
  };
  EXPECT_EQ(file.ReadLevel(4, std::nullopt, ignore).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(file.ReadLevel(0, DiscArea{{NAN, 0.0}, 1.0}, ignore).code(),
            StatusCode::kInvalidArgument);
  const Status failing = file.ReadLevel(
      0, std::nullopt, [](const TileBlob&) { return Status(StatusCode::kTimeout, "enough"); });
  EXPECT_EQ(failing.code(), StatusCode::kTimeout);
}

TEST(AtlasFileTest, WhatIsNoAtlasFileIsTyped) {
  const TestFolder folder;
  const auto code_of = [](const std::filesystem::path& path) {
    return AtlasFile::Open(path).error().code();
  };
  EXPECT_EQ(code_of(folder.path() / "nowhere"), StatusCode::kNotFound);
  EXPECT_EQ(code_of(folder.path()), StatusCode::kInvalidArgument);
  std::ofstream(folder.path() / "text") << "no atlas";
  EXPECT_EQ(code_of(folder.path() / "text"), StatusCode::kInvalidData);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "nowhere"));
}

}  // namespace
}  // namespace atlas
