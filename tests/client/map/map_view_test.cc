// Addresses of cells, the tile cache, and the view that loads through a client.
#include "client/map/map_view.h"

#include <map>

#include <gtest/gtest.h>

#include "client/map/cell_address.h"
#include "client/map/daemon_source.h"
#include "core/tile/tile_codec.h"
#include "tests/client/support/test_peer.h"

namespace atlas {
namespace {

// One layer at `altitude_mm` in one cell.
Tile OneCellTile(const TileId& id, std::size_t cell, std::int32_t altitude_mm) {
  Tile tile = EmptyTile(id, {});
  tile.contributors = {{"car", "monday"}};
  TileLayer layer;
  layer.sigma_100um = 1'000;
  layer.altitude_mm = altitude_mm;
  layer.sigma_100um = 1000;
  layer.observations = 3;
  tile.layers.push_back(layer);
  for (std::size_t i = cell + 1; i < tile.cell_begin.size(); ++i) {
    tile.cell_begin[i] = 1;
  }
  return tile;
}

CellAddress Locate(double x_m, double y_m, std::uint8_t level = 0) {
  return *LocateCell({x_m, y_m}, level, MapProfile());
}

TEST(CellAddressTest, FloorsNegativePlaces) {
  EXPECT_EQ(Locate(0.0, 0.0), (CellAddress{{0, 0, 0}, 0}));
  EXPECT_EQ(Locate(0.0, -3.0), (CellAddress{{0, 0, -1}, 98 * 128}));
  EXPECT_EQ(Locate(-0.05, 0.05), (CellAddress{{0, -1, 0}, 127}));
  EXPECT_EQ(Locate(-1e-7, 0.0), (CellAddress{{0, -1, 0}, 127}));
  EXPECT_EQ(Locate(12.8, 12.7), (CellAddress{{0, 1, 0}, 127 * 128}));
}

TEST(CellAddressTest, DecimalsOnABorderBelongToTheCellAboveIt) {
  for (int i = -5000; i < 5000; ++i) {
    const CellAddress address = Locate(i / 10.0, 0.0);
    EXPECT_EQ(address.tile.x * 128 + static_cast<int>(address.cell), i) << i / 10.0;
    EXPECT_EQ(Locate(i * 0.1, 0.0), address) << i * 0.1;
  }
}

TEST(CellAddressTest, LevelsDoubleTheCell) {
  EXPECT_EQ(Locate(25.6, -0.1, 1), (CellAddress{{1, 1, -1}, 127 * 128}));
  EXPECT_FALSE(LocateCell({0, 0}, 8, MapProfile()));
  EXPECT_FALSE(LocateCell({NAN, 0}, 0, MapProfile()));
  EXPECT_FALSE(LocateCell({0, 1e9}, 0, MapProfile()));
}

TEST(CellAddressTest, DiscTouchesTilesNotCorners) {
  const auto tiles = TilesInDisc({12.8, 12.8}, 1.0, 0, MapProfile(), 100);
  ASSERT_TRUE(tiles);
  EXPECT_EQ(tiles->size(), 4U);
  const auto cross = TilesInDisc({6.4, 6.4}, 7.0, 0, MapProfile(), 100);
  ASSERT_TRUE(cross);
  EXPECT_EQ(cross->size(), 5U);  // the four corners are 9 m away
  EXPECT_FALSE(TilesInDisc({0, 0}, 1000.0, 0, MapProfile(), 100));
}

TEST(TileCacheTest, DropsTheOneUsedLongestAgo) {
  const auto tile = std::make_shared<const Tile>(OneCellTile({0, 0, 0}, 0, 0));
  TileCache cache(3 * (MemoryBytes(*tile) + 200));
  for (int x = 0; x < 3; ++x) {
    cache.Put({0, x, 0}, tile);
  }
  ASSERT_TRUE(cache.Find({0, 0, 0}));
  cache.Put({0, 3, 0}, tile);
  EXPECT_TRUE(cache.Contains({0, 0, 0}));
  EXPECT_FALSE(cache.Contains({0, 1, 0}));
  EXPECT_EQ(cache.size(), 3U);
  cache.Put({0, 9, 9}, nullptr);
  ASSERT_TRUE(cache.Find({0, 9, 9}));
  EXPECT_EQ(*cache.Find({0, 9, 9}), nullptr);
  cache.Clear();
  EXPECT_EQ(cache.size_bytes(), 0U);
}

// A daemon with these tiles at level 0; counts what it is asked.
class TinyAtlas {
 public:
  explicit TinyAtlas(const std::vector<Tile>& tiles) : peer_([this](PeerSocket& s) { Serve(s); }) {
    for (const Tile& tile : tiles) {
      tiles_[tile.id] = EncodeTile(tile, MapProfile()).blob;
    }
    ready_.store(true);
    ready_.notify_all();
  }

  ConnectionOptions options() const { return peer_.options(); }
  int queries() const { return queries_; }

 private:
  void Serve(PeerSocket& socket) {
    ready_.wait(false);
    AnswerHello(socket, {});
    while (const auto request = socket.ReadRequest()) {
      ++queries_;
      const auto& disc = request->query_region().disc();
      const auto wanted =
          TilesInDisc(1e-6 * Eigen::Vector2d(static_cast<double>(disc.x_um()),
                                             static_cast<double>(disc.y_um())),
                      1e-6 * static_cast<double>(disc.radius_um()), 0, MapProfile(), 10'000);
      for (const TileId& id : *wanted) {
        if (tiles_.contains(id)) SendTile(socket, request->request_id(), id);
      }
      wire::Envelope end;
      end.mutable_query_end();
      socket.Reply(request->request_id(), std::move(end));
    }
  }

  void SendTile(PeerSocket& socket, std::uint64_t request_id, const TileId& id) {
    wire::Envelope reply;
    reply.mutable_tile()->set_key(id.Key());
    const Bytes& blob = tiles_.at(id);
    reply.mutable_tile()->set_blob(std::string(blob.begin(), blob.end()));
    socket.Reply(request_id, std::move(reply));
  }

  std::map<TileId, Bytes> tiles_;
  std::atomic<int> queries_{0};
  std::atomic<bool> ready_{false};
  TestPeer peer_;
};

TEST(MapViewTest, FindsTheLayersOfOneCellAndAsksOnce) {
  TinyAtlas atlas({OneCellTile({0, 0, -1}, 98 * 128, 5490)});
  auto client = AtlasClient::Connect(atlas.options());
  ASSERT_TRUE(client);
  DaemonSource source(*client);
  MapView view(source);
  const auto layers = view.LayersAt({0.05, -2.95});
  ASSERT_TRUE(layers) << layers.error().message();
  ASSERT_EQ(layers->size(), 1U);
  EXPECT_EQ(layers->front().altitude_mm, 5490);
  EXPECT_TRUE(view.LayersAt({0.15, -2.95})->empty());
  EXPECT_TRUE(view.LayersAt({500.0, 500.0})->empty());
  EXPECT_TRUE(view.LayersAt({500.0, 500.1})->empty());
  EXPECT_EQ(atlas.queries(), 2);
}

TEST(MapViewTest, LoadKnowsWhatIsNotThere) {
  TinyAtlas atlas({OneCellTile({0, 0, 0}, 0, 1), OneCellTile({0, 1, 0}, 0, 2)});
  auto client = AtlasClient::Connect(atlas.options());
  ASSERT_TRUE(client);
  DaemonSource source(*client);
  MapView view(source);
  ASSERT_TRUE(view.Load({6.4, 6.4}, 40.0, 0).ok());
  EXPECT_EQ(view.tiles_loaded(), 2U);
  EXPECT_EQ(atlas.queries(), 1);
  EXPECT_NE(*view.Get({0, 1, 0}), nullptr);
  EXPECT_EQ(*view.Get({0, -1, 0}), nullptr);
  EXPECT_EQ(atlas.queries(), 1);
}

TEST(MapViewTest, TileTooLargeForTheCacheIsStillHandedOut) {
  TinyAtlas atlas({OneCellTile({0, 0, 0}, 0, 1)});
  auto client = AtlasClient::Connect(atlas.options());
  ASSERT_TRUE(client);
  DaemonSource source(*client);
  MapView view(source, {.max_cache_bytes = 10});
  for (int i = 0; i < 2; ++i) {
    const auto tile = view.Get({0, 0, 0});
    ASSERT_TRUE(tile) << tile.error().message();
    EXPECT_NE(*tile, nullptr);
  }
  EXPECT_EQ(atlas.queries(), 2);
}

}  // namespace
}  // namespace atlas
