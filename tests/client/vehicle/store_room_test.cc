// What a vehicle follows where its store is small: it settles wherever it stands, and is as fine as
// it can be where it drives to.
#include <chrono>
#include <vector>

#include <gtest/gtest.h>

#include "client/vehicle/area_touch.h"
#include "client/vehicle/atlas_view.h"
#include "tests/client/vehicle/dense_tile.h"
#include "tests/client/vehicle/sync_peer.h"

namespace atlas {
namespace {

using Eigen::Vector2d;

constexpr double kRadius_m = 8.0;
constexpr double kSide_m = 1.6;  // of a level-0 tile
constexpr int kGarageTiles = 8;  // to each side of the origin
constexpr int kRoadTiles = 250;
constexpr int kRounds = 16;  // until it settled

TileStore StoreOf(std::size_t bytes) {
  return *TileStore::Open(TinyAtlas(), {.max_memory_bytes = bytes});
}

// A garage around the origin, and a road that leads east.
const TinyWorld& World() {
  static const TinyWorld world = [] {
    TinyWorld made;
    for (int x = -kGarageTiles; x < kGarageTiles; ++x) {
      for (int y = -kGarageTiles; y < kGarageTiles; ++y) {
        made.Put(DenseTile(x, y));
      }
    }
    for (int x = kGarageTiles; x < kRoadTiles; ++x) {
      made.Set(x, 0, 100 * x);
    }
    return made;
  }();
  return world;
}

class StoreRoomTest : public ::testing::Test {
 protected:
  static MapAround Around(AtlasView& view, const Vector2d& place_m, double radius_m = kRadius_m) {
    auto map = view.Around(place_m, radius_m, {.deadline = std::chrono::seconds(60)});
    EXPECT_TRUE(map) << map.error().message();
    return *std::move(map);
  }
  static MapAround Settled(AtlasView& view, const Vector2d& place_m, double radius_m = kRadius_m) {
    for (int call = 1; call < kRounds; ++call) {
      Around(view, place_m, radius_m);
    }
    return Around(view, place_m, radius_m);
  }
  std::uint64_t BytesAround(const Vector2d& place_m, double radius_m = kRadius_m) {
    TileStore large = StoreOf(std::size_t{1} << 28);
    AtlasView view(large, &link_);
    EXPECT_TRUE(Around(view, place_m, radius_m).is_current);
    return large.held_bytes();
  }
  // Of the coarsest tiles that the disc touches.
  std::uint64_t CoarsestBytes(const Vector2d& place_m) const {
    std::uint64_t bytes = 0;
    for (const auto& [id, stored] : World().tiles()) {
      const bool is_coarsest = id.level + 1 == TinyProfile().levels;
      const bool is_there = Touches(DiscArea{place_m, kRadius_m}, id, TinyProfile());
      if (is_coarsest && is_there) bytes += stored.encoded.blob.size();
    }
    return bytes;
  }
  // After it drove from the garage.
  void ExpectAsFineAsAFreshView(AtlasView& view, const Vector2d& place_m, std::size_t bytes) {
    TileStore fresh_store = StoreOf(bytes);
    AtlasView fresh_view(fresh_store, &link_);
    const MapAround fresh = Settled(fresh_view, place_m);
    const MapAround map = Around(view, place_m);
    EXPECT_EQ(map.finest_places, fresh.finest_places) << place_m.x();
    EXPECT_EQ(map.coarse_places, fresh.coarse_places) << place_m.x();
    EXPECT_EQ(map.is_current, fresh.is_current) << place_m.x();
  }

  SyncPeer peer_{World()};
  AtlasLink link_{LinkOptions{.connection = peer_.options()}};
};

TEST_F(StoreRoomTest, WhereverItStandsItSettles) {
  const std::vector<Vector2d> places_m = {
      {0.0, 0.0},                                          // a corner of tiles of all levels
      {0.01, -0.01},                                       // next to it
      {3 * kSide_m, 0.02},                                 // of the finest two
      {0.9, 0.7},          {kSide_m * kGarageTiles, 0.3},  // where the garage ends
  };
  for (const Vector2d& place_m : places_m) {
    const std::uint64_t all = BytesAround(place_m);
    const std::uint64_t least = CoarsestBytes(place_m);
    for (const double part : {0.0, 0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 0.95}) {
      const auto bytes = least + static_cast<std::size_t>(part * static_cast<double>(all - least));
      TileStore store = StoreOf(bytes);
      AtlasView view(store, &link_);
      Settled(view, place_m);
      for (int call = 0; call < 3; ++call) {
        const MapAround map = Around(view, place_m);
        EXPECT_EQ(map.transfer.tiles, 0U) << part << " at " << place_m.transpose();
        EXPECT_EQ(map.sync.code(), StatusCode::kResourceExhausted);
        EXPECT_FALSE(map.is_current);
        EXPECT_FALSE(map.tiles.empty());
      }
    }
  }
}

TEST_F(StoreRoomTest, FromADensePlaceToASparseOneItGetsFineAgain) {
  const std::uint64_t garage = BytesAround({0.0, 0.0});
  const std::uint64_t road = BytesAround({100.0, 0.5});
  ASSERT_GT(garage, 20 * road) << "else this tells nothing";
  for (const std::size_t bytes : {garage / 2, garage / 10, 4 * road}) {
    TileStore store = StoreOf(bytes);
    AtlasView view(store, &link_);
    EXPECT_FALSE(Settled(view, {0.0, 0.5}).is_current);
    double x_m = 0.0;
    for (; x_m < kGarageTiles * kSide_m + 4 * kRadius_m; x_m += 0.8) {
      Around(view, {x_m, 0.5});
    }
    ExpectAsFineAsAFreshView(view, {x_m, 0.5}, bytes);
  }
}

// The coarse tiles of where it was go last: they are not to leave less and less for where it is.
TEST_F(StoreRoomTest, OnALongWayItStaysAsFine) {
  constexpr double kFar_m = 20.0;
  const std::size_t bytes = BytesAround({100.0, 0.5}, kFar_m) * 3 / 4;
  TileStore fresh_store = StoreOf(bytes);
  AtlasView fresh_view(fresh_store, &link_);
  const std::uint64_t fresh = Settled(fresh_view, {100.0, 0.5}, kFar_m).finest_places;
  EXPECT_GT(fresh, 4U);
  TileStore store = StoreOf(bytes);
  AtlasView view(store, &link_);
  for (double x_m = 50.0; x_m < kRoadTiles * kSide_m - kFar_m; x_m += 0.8) {
    const MapAround map = Around(view, {x_m, 0.5}, kFar_m);
    if (x_m > 100.0) {
      EXPECT_GE(2 * map.finest_places, fresh) << x_m;
    }
  }
}

}  // namespace
}  // namespace atlas
