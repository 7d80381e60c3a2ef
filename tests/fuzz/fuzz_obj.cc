// Wavefront OBJ files, and what casts rays into the meshes that they hold.
#include "core/simulation/mesh/mesh_bvh.h"
#include "core/simulation/mesh/obj_reader.h"
#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {
namespace {

std::vector<Bytes> Seeds() {
  return {BytesOf("# a square\nmtllib a.mtl\nv 0 0 0\nv 4 0 0.5\nv 4 4 1e-3\nv 0 4 0\nvt 0 1\n"
                  "f 1/1/1 2//2 3/3 -1\n"),
          BytesOf("v -9e6 9e6 1\nv -9e6 9000010 1\nv -8999990 9e6 1\nf \\\n 1 2 3\r\n")};
}

bool Run(ByteSpan text) {
  const auto mesh = ParseObj(TextOf(text), "mesh.obj");
  if (!mesh) {
    return false;
  }
  for (const Eigen::Vector3f& vertex : mesh->mesh.vertices) {
    Require(vertex.allFinite(), "vertices are finite");
  }
  const MeshBvh bvh(mesh->mesh);
  for (const Eigen::Vector3f& direction :
       {Eigen::Vector3f(0.0F, 0.0F, -1.0F), Eigen::Vector3f(0.6F, 0.8F, 0.0F)}) {
    const MeshHit hit = bvh.Cast({{1.0F, 1.0F, 2.0F}, direction}, 1e3F);
    Require(!hit.is_hit() || (hit.distance_m >= 0.0F && hit.distance_m <= 1e3F),
            "what is hit is within reach");
  }
  return true;
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz
