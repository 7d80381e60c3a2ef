// The hierarchy against trying every triangle, and the triangle test against known geometry.
#include "core/simulation/mesh/mesh_bvh.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/base/hash_random.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas {
namespace {

MeshHit BruteForce(const TriangleMesh& mesh, const MeshRay& ray, float max_distance_m) {
  MeshHit nearest{max_distance_m, MeshHit::kNone};
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const float distance_m = IntersectTriangle(ray, EdgesOf(mesh, i));
    if (distance_m < nearest.distance_m) {
      nearest = {distance_m, i};
    }
  }
  return nearest;
}

Eigen::Vector3f RandomIn(HashRandom& random, double half_side) {
  const auto axis = [&] {
    return static_cast<float>(random.Uniform(-half_side, half_side));
  };
  const float x = axis();
  const float y = axis();
  const float z = axis();
  return {x, y, z};
}

TriangleMesh RandomTriangles(std::uint64_t seed, std::uint32_t count) {
  HashRandom random(seed);
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Eigen::Vector3f middle = RandomIn(random, 50.0);
    for (int corner = 0; corner < 3; ++corner) {
      mesh.vertices.emplace_back(middle + RandomIn(random, 4.0));
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    mesh.labels.push_back(i);
  }
  return mesh;
}

void ExpectSameAsBruteForce(const TriangleMesh& mesh, std::uint64_t seed, int rays) {
  const MeshBvh bvh(mesh);
  HashRandom random(seed);
  int hits = 0;
  for (int i = 0; i < rays; ++i) {
    const MeshRay ray{RandomIn(random, 60.0), RandomIn(random, 1.0).normalized()};
    const MeshHit expected = BruteForce(mesh, ray, 100.0F);
    const MeshHit hit = bvh.Cast(ray, 100.0F);
    ASSERT_EQ(hit.is_hit(), expected.is_hit()) << "ray " << i;
    ASSERT_EQ(hit.distance_m, expected.distance_m) << "ray " << i;
    hits += hit.is_hit() ? 1 : 0;
  }
  EXPECT_GE(hits, rays / 20);
}

TEST(TriangleTest, HitsAtTheKnownDistanceFromBothSides) {
  const TriangleEdges triangle{{2.0F, -1.0F, -1.0F}, {0.0F, 3.0F, 0.0F}, {0.0F, 0.0F, 3.0F}};
  EXPECT_FLOAT_EQ(IntersectTriangle({{0, 0, 0}, {1, 0, 0}}, triangle), 2.0F);
  EXPECT_FLOAT_EQ(IntersectTriangle({{5, 0, 0}, {-1, 0, 0}}, triangle), 3.0F);
  EXPECT_TRUE(std::isinf(IntersectTriangle({{0, 0, 0}, {-1, 0, 0}}, triangle)));       // behind
  EXPECT_TRUE(std::isinf(IntersectTriangle({{0, 0, 0}, {0, 1, 0}}, triangle)));        // parallel
  EXPECT_TRUE(std::isinf(IntersectTriangle({{0, 1.5F, 1.5F}, {1, 0, 0}}, triangle)));  // beside
}

TEST(MeshBvhTest, AgreesWithBruteForceOnRandomTriangles) {
  ExpectSameAsBruteForce(RandomTriangles(1, 700), 2, 2000);
}

TEST(MeshBvhTest, AgreesWithBruteForceInTheGarage) {
  const auto world = MakeGarageWorld({});
  ASSERT_TRUE(world.has_value());
  ExpectSameAsBruteForce(world->mesh, 3, 1500);
}

TEST(MeshBvhTest, ManyTrianglesInOnePlaceStillBuild) {
  TriangleMesh mesh = RandomTriangles(5, 1);
  for (int i = 0; i < 500; ++i) {
    mesh.triangles.push_back(mesh.triangles.front());
    mesh.labels.push_back(0);
  }
  ExpectSameAsBruteForce(mesh, 6, 0);
  const Eigen::Vector3f middle = (mesh.vertices[0] + mesh.vertices[1] + mesh.vertices[2]) / 3.0F;
  const Eigen::Vector3f origin = middle + Eigen::Vector3f(20.0F, 3.0F, -7.0F);
  EXPECT_TRUE(MeshBvh(mesh).Cast({origin, (middle - origin).normalized()}, 100.0F).is_hit());
}

TEST(MeshBvhTest, EmptyMeshIsNeverHit) {
  EXPECT_FALSE(MeshBvh(TriangleMesh{}).Cast(MeshRay{}, 100.0F).is_hit());
  EXPECT_FALSE(MeshBvh().Cast(MeshRay{}, 100.0F).is_hit());
}

TEST(MeshBvhTest, NothingBeyondTheGivenDistance) {
  TriangleMesh wall;
  wall.vertices = {{10, -5, -5}, {10, 5, -5}, {10, 0, 5}};
  wall.triangles = {{0, 1, 2}};
  wall.labels = {7};
  EXPECT_TRUE(MeshBvh(wall).Cast(MeshRay{}, 10.1F).is_hit());
  EXPECT_FALSE(MeshBvh(wall).Cast(MeshRay{}, 9.9F).is_hit());
}

}  // namespace
}  // namespace atlas
