// What stands still around a place, in parts that rays are cast against.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/simulation/mesh/mesh_bvh.h"
#include "core/simulation/mesh/triangle_mesh.h"

namespace atlas {

// A mesh that can be cast against. Its vertices are relative to `origin_m` (world frame), which
// lies near it: float32 is too coarse far from its zero.
struct CastableMesh {
  TriangleMesh mesh;
  MeshBvh bvh;
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();

  CastableMesh() = default;
  explicit CastableMesh(TriangleMesh m, const Eigen::Vector3d& origin = Eigen::Vector3d::Zero())
      : mesh(std::move(m)), bvh(mesh), origin_m(origin) {}
};

using WorldParts = std::vector<std::shared_ptr<const CastableMesh>>;

// The nearest hit among the parts, and the ray as that part sees it.
struct WorldHit {
  MeshHit hit;
  const CastableMesh* part = nullptr;
  MeshRay ray;

  bool is_hit() const { return part != nullptr; }
  std::uint32_t label() const { return part->mesh.labels[hit.triangle]; }
};

WorldHit CastWorld(const WorldParts& parts,
                   const Eigen::Vector3d& origin_m,
                   const Eigen::Vector3f& direction,
                   float max_distance_m);

class StaticWorld {
 public:
  virtual ~StaticWorld() = default;

  // All parts that reach into the circle (in plan) around `p_world`, the nearest first. The same
  // for every caller and in any order of calls; may be called by several threads.
  virtual WorldParts Around(const Eigen::Vector3d& p_world, double radius_m) const = 0;
};

// One mesh that is there as a whole.
class MeshWorld : public StaticWorld {
 public:
  explicit MeshWorld(TriangleMesh mesh, const Eigen::Vector3d& origin = Eigen::Vector3d::Zero())
      : part_(std::make_shared<const CastableMesh>(std::move(mesh), origin)) {}

  WorldParts Around(const Eigen::Vector3d& /*p_world*/, double /*radius_m*/) const override {
    return {part_};
  }
  const CastableMesh& part() const { return *part_; }

 private:
  std::shared_ptr<const CastableMesh> part_;
};

}  // namespace atlas
