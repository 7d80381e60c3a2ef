// What becomes of tiles when the daemon stops while they are built.
#include "server/service/fusion/tile_refresher.h"

#include <stop_token>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

class TileRefresherTest : public ServiceTest {};

TEST_F(TileRefresherTest, WhatIsNotBegunWhenItStopsIsLeft) {
  Open(0);
  UploadDrive(4);
  const std::vector<TileId> tiles = store_->ListFootprintTiles(0, -1, 100).value();
  ASSERT_GT(tiles.size(), 1u);
  TileRefresher refresher(*store_, {}, [](LogLevel, const std::string&) {});
  std::stop_source stop;
  std::size_t built = 0;
  std::size_t left = 0;
  const auto count = [&](const TileId&, const Result<BuiltTile>& tile) {
    built += tile ? 1u : 0u;
    left += !tile && tile.error().code() == StatusCode::kUnavailable ? 1u : 0u;
  };
  refresher.Build(tiles, stop.get_token(), count);
  EXPECT_EQ(built, tiles.size());
  stop.request_stop();
  refresher.Build(tiles, stop.get_token(), count);
  EXPECT_EQ(built, tiles.size());
  EXPECT_EQ(left, tiles.size());
}

}  // namespace
}  // namespace atlas
