// A whole garage of eight decks, mapped from its mesh: up the ramps, or not at all.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/simulation/mesh/mesh_bvh.h"
#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/simulated_world.h"
#include "tests/core/planning/tiny_world.h"

namespace atlas {
namespace {

constexpr int kDecks = 8;
constexpr double kTop_m = 3.2 * (kDecks - 1);

struct Surface {
  double z_m = 0.0;
  bool is_ground = false;
};

// What a plumb line meets, from below.
std::vector<Surface> PlumbLine(const MeshBvh& bvh, const TriangleMesh& mesh, double x, double y) {
  std::vector<Surface> surfaces;
  MeshRay ray{Eigen::Vector3d(x, y, 40.0).cast<float>(), -Eigen::Vector3f::UnitZ()};
  MeshHit hit = bvh.Cast(ray, 100.0F);
  while (hit.is_hit()) {
    ray.origin.z() -= hit.distance_m;
    surfaces.push_back({ray.origin.z(), IsGroundLabel(mesh.labels[hit.triangle])});
    ray.origin.z() -= 0.001F;
    hit = bvh.Cast(ray, 100.0F);
  }
  std::reverse(surfaces.begin(), surfaces.end());
  return surfaces;
}

// Ground with something 0.3 m to 2 m above it is an obstacle; what lies closer below another
// surface is never seen.
void MapCell(const std::vector<Surface>& surfaces, std::int64_t x, std::int64_t y, TinyWorld& out) {
  for (const Surface& floor : surfaces) {
    if (!floor.is_ground) {
      continue;
    }
    TileLayer layer = FreeLayer(floor.z_m);
    const bool is_covered = std::any_of(surfaces.begin(), surfaces.end(), [&](const Surface& s) {
      return &s > &floor && s.z_m < floor.z_m + 0.5 && s.is_ground;
    });
    const bool is_blocked = std::any_of(surfaces.begin(), surfaces.end(), [&](const Surface& s) {
      return s.z_m > floor.z_m + 0.3 && s.z_m < floor.z_m + 2.0;
    });
    if (is_blocked) {
      layer.occupancy = 64;
      layer.flags = TileLayer::kMeasured;
    }
    if (!is_covered) {
      out.Put(x, y, layer);
    }
  }
}

TinyWorld MapGarage() {
  const SimulatedWorld garage = MakeGarageWorld({.decks = kDecks}).value();
  const MeshBvh bvh(garage.mesh);
  TinyWorld map;
  for (std::int64_t y = -95; y < 178; ++y) {
    for (std::int64_t x = -255; x < 300; ++x) {
      const auto middle = [](std::int64_t cell) {
        return 0.1 * (static_cast<double>(cell) + 0.5);
      };
      MapCell(PlumbLine(bvh, garage.mesh, middle(x), middle(y)), x, y, map);
    }
  }
  return map;
}

// Mapped once for all tests.
TinyWorld& Garage() {
  static TinyWorld map = MapGarage();
  return map;
}

Result<Route> PlanToTheRoof(double max_slope_deg) {
  PlanRequest request{{28.0, 10.0, 0.0}, {-9.0, 10.0, kTop_m}, {}};
  request.options.max_slope_deg = max_slope_deg;
  return PlanRoute(Garage(), Garage().profile(), request);
}

TEST(GarageRouteTest, FromTheStreetToTheRoof) {
  const auto route = PlanToTheRoof(25.0);
  ASSERT_TRUE(route.has_value()) << route.error().message();
  ASSERT_TRUE(route->found);
  EXPECT_GT(route->length_m, 7 * 22.0 + 7 * 20.0);
  EXPECT_LT(route->length_m, 7 * 75.4 + 60.0);
  double last_z_m = 0.0;
  for (const Eigen::Vector3d& waypoint : route->waypoints) {
    EXPECT_LE(std::abs(waypoint.z() - last_z_m), 0.2);
    last_z_m = waypoint.z();
  }
  EXPECT_NEAR(last_z_m, kTop_m, 0.01);
}

TEST(GarageRouteTest, FiveDegreesDoNotClimbItsRamps) {
  const auto route = PlanToTheRoof(5.0);
  ASSERT_TRUE(route.has_value()) << route.error().message();
  EXPECT_FALSE(route->found);
}

TEST(GarageRouteTest, DecksStayPassableAtFiveDegrees) {
  PlanRequest request{{-9.0, 10.0, 3.2}, {9.0, 10.0, 3.2}, {}};
  request.options.max_slope_deg = 5.0;
  const auto route = PlanRoute(Garage(), Garage().profile(), request);
  ASSERT_TRUE(route.has_value()) << route.error().message();
  EXPECT_TRUE(route->found);
  EXPECT_NEAR(route->length_m, 18.0, 0.5);
}

}  // namespace
}  // namespace atlas
