// Floors, ceilings, ramps and decks of meshes without labels.
#include "core/simulation/mesh/mesh_labels.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/mesh_builder.h"

namespace atlas {
namespace {

// A quad whose corners are listed counter-clockwise as seen from above.
void AddFloor(double z_m, MeshBuilder& out) {
  out.Quad({0.0, 0.0, z_m}, {20.0, 0.0, z_m}, {20.0, 20.0, z_m}, {0.0, 20.0, z_m}, 0);
}
void AddCeiling(double z_m, MeshBuilder& out) {
  out.Quad({0.0, 20.0, z_m}, {20.0, 20.0, z_m}, {20.0, 0.0, z_m}, {0.0, 0.0, z_m}, 0);
}
void AddRamp(double degrees, MeshBuilder& out) {
  const double rise_m = 10.0 * std::tan(degrees * std::numbers::pi / 180.0);
  out.Quad({30.0, 0.0, 0.0}, {40.0, 0.0, rise_m}, {40.0, 4.0, rise_m}, {30.0, 4.0, 0.0}, 0);
}

TEST(MeshLabelsTest, FloorsAreRoadAndCeilingsAreNot) {
  MeshBuilder builder;
  AddFloor(0.0, builder);
  AddCeiling(2.8, builder);
  AddFloor(3.0, builder);
  TriangleMesh mesh = builder.Take();
  LabelMesh(mesh);
  EXPECT_EQ(mesh.labels[0], TruthLabel(TruthClass::kRoad, 0));
  EXPECT_EQ(ClassOfLabel(mesh.labels[2]), TruthClass::kOtherStructure);
  EXPECT_EQ(mesh.labels[4], TruthLabel(TruthClass::kRoad, 1));
}

TEST(MeshLabelsTest, RampsUpTo25DegreesAreRoadOfTheDeckTheyRiseFrom) {
  for (const double degrees : {18.5, 24.0, 26.0}) {
    MeshBuilder builder;
    AddFloor(0.0, builder);
    AddFloor(4.0, builder);
    AddRamp(degrees, builder);
    TriangleMesh mesh = builder.Take();
    LabelMesh(mesh);
    const bool is_road = degrees < 25.0;
    EXPECT_EQ(mesh.labels[4],
              TruthLabel(is_road ? TruthClass::kRoad : TruthClass::kOtherStructure, 0));
  }
}

TEST(MeshLabelsTest, WhereTheWindingSaysNothingEitherSideIsUp) {
  MeshBuilder builder;
  AddCeiling(0.0, builder);
  TriangleMesh mesh = builder.Take();
  LabelMesh(mesh);
  EXPECT_EQ(mesh.labels[0], TruthLabel(TruthClass::kRoad, 0));
}

TEST(MeshLabelsTest, TrianglesWithoutAreaAreStructure) {
  TriangleMesh mesh;
  mesh.vertices = {{0.0F, 0.0F, 0.0F}, {1.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 0.0F}};
  mesh.triangles = {{0, 1, 2}, {0, 0, 0}};
  mesh.labels = {0, 0};
  LabelMesh(mesh);
  EXPECT_EQ(ClassOfLabel(mesh.labels[1]), TruthClass::kOtherStructure);
}

}  // namespace
}  // namespace atlas
