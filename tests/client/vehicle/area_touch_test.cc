// Which tiles areas touch, against points of the areas themselves.
#include "client/vehicle/area_touch.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

using Eigen::Vector2d;

MapProfile Profile() {
  MapProfile profile;
  profile.cell_size_um = 100'000;
  profile.tile_cells = 10;  // 1 m a tile
  return profile;
}

bool Touched(const MapArea& area, int x, int y, std::uint8_t level = 0) {
  return Touches(area, {level, x, y}, Profile());
}

double DistanceToTile(const Vector2d& p_m, int x, int y) {
  const Vector2d low(x, y);
  return (p_m.cwiseMax(low).cwiseMin(low + Vector2d::Ones()) - p_m).norm();
}

TEST(AreaTouchTest, EdgesBelongToAreas) {
  EXPECT_TRUE(Touched(DiscArea{{0.5, 0.5}, 0.5}, 1, 0));
  EXPECT_FALSE(Touched(DiscArea{{0.5, 0.5}, 0.499}, 1, 0));
  EXPECT_TRUE(Touched(BoxArea{{0.2, 0.2}, {1.0, 0.9}}, 1, 0));
  EXPECT_FALSE(Touched(BoxArea{{0.2, 0.2}, {0.99, 0.9}}, 1, 0));
  EXPECT_TRUE(Touched(BoxArea{{2.2, 0.2}, {2.3, 0.9}}, 1, 0, 1));
}

TEST(AreaTouchTest, TilesAreThemselves) {
  const TilesArea tiles{{{0, 1, 2}, {1, 5, 5}}};
  EXPECT_TRUE(Touched(tiles, 1, 2));
  EXPECT_TRUE(Touched(tiles, 5, 5, 1));
  EXPECT_FALSE(Touched(tiles, 5, 5));
  EXPECT_FALSE(Touched(tiles, 0, 1, 1));
}

TEST(AreaTouchTest, ARouteOfOnePointIsADisc) {
  EXPECT_TRUE(Touched(CorridorArea{{{0.5, 0.5}}, 0.5}, 1, 0));
  EXPECT_FALSE(Touched(CorridorArea{{{0.5, 0.5}}, 0.4}, 1, 0));
  EXPECT_FALSE(Touched(CorridorArea{{}, 5.0}, 0, 0));
}

// A tile is touched exactly when some point of the route is near enough to it.
TEST(AreaTouchTest, CorridorsAgreeWithTheirPoints) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place_m(-4.0, 4.0);
  int touched = 0;
  for (int route = 0; route < 200; ++route) {
    CorridorArea corridor{{{place_m(random), place_m(random)},
                           {place_m(random), place_m(random)},
                           {place_m(random), place_m(random)}},
                          std::abs(place_m(random)) / 3.0};
    if (route % 5 == 0) corridor.route_m[1].x() = corridor.route_m[0].x();
    if (route % 7 == 0) corridor.half_width_m = 0.0;
    for (int x = -6; x < 6; ++x) {
      for (int y = -6; y < 6; ++y) {
        double nearest_m = 1e9;
        for (int i = 0; i <= 2'000; ++i) {
          const std::size_t leg = i < 1'000 ? 0 : 1;
          const double part = (i - 1'000.0 * static_cast<double>(leg)) / 1'000.0;
          const Vector2d p_m =
              corridor.route_m[leg] + part * (corridor.route_m[leg + 1] - corridor.route_m[leg]);
          nearest_m = std::min(nearest_m, DistanceToTile(p_m, x, y));
        }
        const bool is_touched = Touched(corridor, x, y);
        touched += is_touched ? 1 : 0;
        // The points are up to 6 mm off those between them.
        if (nearest_m <= corridor.half_width_m) {
          EXPECT_TRUE(is_touched) << route;
        } else if (nearest_m > corridor.half_width_m + 0.006) {
          EXPECT_FALSE(is_touched) << route;
        }
      }
    }
  }
  EXPECT_GT(touched, 1'000);
}

}  // namespace
}  // namespace atlas
