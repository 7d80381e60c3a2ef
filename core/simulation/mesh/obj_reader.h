// Wavefront OBJ files as meshes: vertices and faces; materials, normals, textures and all else are
// skipped. Files may be anything.
#pragma once

#include <filesystem>
#include <string_view>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/simulation/mesh/triangle_mesh.h"

namespace atlas {

// Metres, z up. Vertices are relative to `origin_m`, the middle of the mesh in whole metres.
struct ObjMesh {
  TriangleMesh mesh;  // labels are all 0
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
};

// Lines `v x y z ...` and `f a b c ...` (also a/t, a//n, a/t/n; negative numbers count back from
// the last vertex); polygons are cut as fans. kInvalidData naming file and line: a number that is
// none, not finite or beyond 10,000 km, a face of fewer than three corners or with one that is not
// there yet, no face at all, a mesh more than 20 km across. kNotFound, kPermissionDenied,
// kResourceExhausted (above 1 GiB) as the file is.
Result<ObjMesh> ReadObj(const std::filesystem::path& path);

// `name` stands for the file in messages.
Result<ObjMesh> ParseObj(std::string_view text, std::string_view name);

}  // namespace atlas
