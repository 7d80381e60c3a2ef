// The worlds are what they say: curbs of 12 cm, a bridge at 5.5 m, decks above each other.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "core/simulation/mesh/mesh_bvh.h"
#include "core/simulation/simulated_drive.h"
#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/props.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas {
namespace {

struct Surface {
  double z_m = 0.0;
  std::uint32_t label = 0;
};

// Everything that a plumb line at (x, y) meets, from the top.
std::vector<Surface> PlumbLine(const TriangleMesh& mesh, double x, double y) {
  const MeshBvh bvh(mesh);
  std::vector<Surface> surfaces;
  MeshRay ray{Eigen::Vector3d(x, y, 90.0).cast<float>(), -Eigen::Vector3f::UnitZ()};
  for (;;) {
    const MeshHit hit = bvh.Cast(ray, 200.0F);
    if (!hit.is_hit()) {
      return surfaces;
    }
    ray.origin.z() -= hit.distance_m;
    surfaces.push_back({ray.origin.z(), mesh.labels[hit.triangle]});
    ray.origin.z() -= 0.001F;
  }
}

std::vector<Surface> Ground(const TriangleMesh& mesh, double x, double y) {
  std::vector<Surface> surfaces = PlumbLine(mesh, x, y);
  std::erase_if(surfaces, [](const Surface& s) { return !IsGroundLabel(s.label); });
  std::reverse(surfaces.begin(), surfaces.end());
  return surfaces;
}

TEST(StreetWorldTest, CurbsAreTwelveCentimetresHighOnBothSides) {
  const SimulatedWorld world = MakeStreetWorld();
  const DrivePath& street = world.legs.front();
  for (const double along_m : {10.0, 60.0, 115.0, 200.0}) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d below = street.At(along_m, side * 4.98).position;
      const Eigen::Vector3d above = street.At(along_m, side * 5.02).position;
      const auto road = Ground(world.mesh, below.x(), below.y());
      const auto sidewalk = Ground(world.mesh, above.x(), above.y());
      ASSERT_FALSE(road.empty());
      ASSERT_FALSE(sidewalk.empty());
      EXPECT_NEAR(sidewalk[0].z_m - road[0].z_m, 0.12, 1e-3) << along_m << " " << side;
      EXPECT_EQ(ClassOfLabel(sidewalk[0].label), TruthClass::kSidewalk);
    }
  }
}

TEST(StreetWorldTest, HoldsEveryClassItPromises) {
  const SimulatedWorld world = MakeStreetWorld();
  for (const TruthClass wanted :
       {TruthClass::kRoad, TruthClass::kSidewalk, TruthClass::kParking, TruthClass::kCar,
        TruthClass::kBuilding, TruthClass::kFence, TruthClass::kTrunk, TruthClass::kPole}) {
    EXPECT_NE(std::find(world.mesh.labels.begin(), world.mesh.labels.end(), TruthLabel(wanted)),
              world.mesh.labels.end())
        << static_cast<int>(wanted);
  }
  EXPECT_GE(world.traffic.size(), 3U);
}

TEST(OverpassWorldTest, TwoRoadsCrossWithASlabBetween) {
  const SimulatedWorld world = MakeOverpassWorld();
  const auto ground = Ground(world.mesh, 0.0, -3.0);
  ASSERT_EQ(ground.size(), 2U);
  EXPECT_NEAR(ground[0].z_m, 0.0, 1e-3);
  EXPECT_EQ(ground[0].label, TruthLabel(TruthClass::kRoad, 0));
  EXPECT_NEAR(ground[1].z_m, 5.5, 1e-3);
  EXPECT_EQ(ground[1].label, TruthLabel(TruthClass::kRoad, 1));
  const auto all = PlumbLine(world.mesh, 0.0, -3.0);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_NEAR(all[1].z_m, 4.9, 1e-3);  // the underside
}

TEST(GarageWorldTest, DecksAreWhereTheirLabelsSay) {
  GarageOptions options;
  options.decks = 8;
  const auto world = MakeGarageWorld(options);
  ASSERT_TRUE(world.has_value());
  const auto decks = Ground(world->mesh, -17.0, 9.0);
  ASSERT_EQ(decks.size(), 8U);
  for (std::uint32_t i = 0; i < decks.size(); ++i) {
    EXPECT_NEAR(decks[i].z_m, 3.2 * i, 1e-3);
    EXPECT_EQ(DeckOfLabel(decks[i].label), i);
  }
}

TEST(GarageWorldTest, RampsJoinDecksWithoutAStep) {
  const auto world = MakeGarageWorld({});
  ASSERT_TRUE(world.has_value());
  const MeshBvh bvh(world->mesh);
  const DrivePath& path = world->legs.front();
  double last_z_m = 0.0;
  for (const double along_m : EvenlySpaced(0.0, path.length_m(), 0.1)) {
    const Eigen::Vector3d p = path.At(along_m).position;
    const Eigen::Vector3d above = p + Eigen::Vector3d::UnitZ();
    const MeshHit hit = bvh.Cast({above.cast<float>(), -Eigen::Vector3f::UnitZ()}, 3.0F);
    ASSERT_TRUE(hit.is_hit()) << along_m;
    const double z_m = above.z() - static_cast<double>(hit.distance_m);
    ASSERT_NEAR(z_m, p.z(), 0.02) << along_m;
    ASSERT_LT(z_m - last_z_m, 0.02) << along_m;
    last_z_m = z_m;
  }
  EXPECT_NEAR(last_z_m, 9.6, 1e-3);
}

TEST(GarageWorldTest, ScansKnowTheDecksTheySee) {
  const auto drive = SimulatedDrive::Create(MakeGarageWorld({}).value(), {});
  ASSERT_TRUE(drive.has_value());
  const std::size_t last = drive->scans() - 1;
  const SimulatedScan scan = drive->Scan(last);
  std::size_t roof = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const SimulatedPoint& p = scan.points[i];
    const Eigen::Vector3d p_world = drive->sensor_pose(last) * Eigen::Vector3d(p.x, p.y, p.z);
    const TruthClass truth = ClassOfLabel(scan.labels[i]);
    if (truth == TruthClass::kRoad && DeckOfLabel(scan.labels[i]) == 3) {
      ++roof;
      ASSERT_NEAR(p_world.z(), 9.6, 0.08);
    }
  }
  EXPECT_GT(roof, 2000U);
}

TEST(GarageWorldTest, RefusesImpossibleGarages) {
  EXPECT_EQ(MakeGarageWorld({.decks = 1}).error().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(MakeGarageWorld({.decks = 99}).error().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(MakeGarageWorld({.deck_height_m = 9.0}).error().code(), StatusCode::kInvalidArgument);
}

TEST(WorldKindTest, NamesAreThoseOfTheCommandLine) {
  EXPECT_EQ(WorldKindByName("garage").value(), WorldKind::kGarage);
  EXPECT_EQ(WorldKindByName("moon").error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
