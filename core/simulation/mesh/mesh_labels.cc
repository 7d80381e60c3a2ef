// Normals, plumb lines, and a histogram of heights.
#include "core/simulation/mesh/mesh_labels.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "core/simulation/mesh/mesh_bvh.h"
#include "core/simulation/truth_label.h"

namespace atlas {
namespace {

constexpr double kLevelBin_m = 0.5;
constexpr int kProbes = 64;  // plumb lines a side

struct Facet {
  double area_m2 = 0.0;
  double up = 0.0;  // z of the unit normal; 0 for a triangle without area
  double low_m = 0.0;
};

Facet FacetOf(const TriangleMesh& mesh, std::uint32_t triangle) {
  const TriangleEdges edges = EdgesOf(mesh, triangle);
  const Eigen::Vector3d normal = edges.edge1.cast<double>().cross(edges.edge2.cast<double>());
  Facet facet;
  facet.area_m2 = 0.5 * normal.norm();
  facet.up = facet.area_m2 > 0.0 ? normal.normalized().z() : 0.0;
  const float rise = std::min({0.0F, edges.edge1.z(), edges.edge2.z()});
  facet.low_m = static_cast<double>(edges.corner.z() + rise);
  return facet;
}

double CosOfDegrees(double degrees) {
  return std::cos(degrees * std::numbers::pi / 180.0);
}

// Of the flat triangles that a grid of plumb lines meets first, the share that faces up.
double ShareFacingUp(const TriangleMesh& mesh, double min_up) {
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    bounds.extend(vertex);
  }
  const MeshBvh bvh(mesh);
  int flat = 0;
  int facing_up = 0;
  for (int i = 0; i < kProbes * kProbes; ++i) {
    const int column = i % kProbes;
    const int row = i / kProbes;
    const Eigen::Array2f at((static_cast<float>(column) + 0.5F) / kProbes,
                            (static_cast<float>(row) + 0.5F) / kProbes);
    MeshRay down;
    down.origin.head<2>() = bounds.min().head<2>().array() + at * bounds.sizes().head<2>().array();
    down.origin.z() = bounds.max().z() + 1.0F;
    down.direction = -Eigen::Vector3f::UnitZ();
    const MeshHit hit = bvh.Cast(down, std::numeric_limits<float>::infinity());
    const double up = hit.is_hit() ? FacetOf(mesh, hit.triangle).up : 0.0;
    flat += std::abs(up) >= min_up ? 1 : 0;
    facing_up += up >= min_up ? 1 : 0;
  }
  return flat == 0 ? 0.0 : static_cast<double>(facing_up) / flat;
}

// Heights of the decks above the lowest, ascending.
std::vector<double> UpperDecks(const std::vector<Facet>& facets, const MeshLabelOptions& options) {
  const double min_up = CosOfDegrees(options.level_slope_deg);
  std::map<int, double> area_at;  // bin of height to level area
  double whole_m2 = 0.0;
  for (const Facet& facet : facets) {
    if (facet.up >= min_up) {
      area_at[static_cast<int>(std::floor(facet.low_m / kLevelBin_m))] += facet.area_m2;
      whole_m2 += facet.area_m2;
    }
  }
  // The largest level first; what is near a larger one belongs to it.
  std::vector<std::pair<double, double>> by_area;
  by_area.reserve(area_at.size());
  for (const auto& [bin, area_m2] : area_at) {
    by_area.emplace_back(-area_m2, bin * kLevelBin_m);
  }
  std::sort(by_area.begin(), by_area.end());
  std::vector<double> decks;
  for (const auto& [minus_area_m2, height_m] : by_area) {
    const bool is_apart = std::all_of(decks.begin(), decks.end(), [&, z_m = height_m](double deck) {
      return std::abs(z_m - deck) >= options.deck_gap_m;
    });
    if (is_apart && -minus_area_m2 >= options.min_deck_share * whole_m2) {
      decks.push_back(height_m);
    }
  }
  std::sort(decks.begin(), decks.end());
  if (!decks.empty()) {
    decks.erase(decks.begin());
  }
  return decks;
}

}  // namespace

void LabelMesh(TriangleMesh& mesh, const MeshLabelOptions& options) {
  const double min_up = CosOfDegrees(options.max_slope_deg);
  const bool is_winding_known = ShareFacingUp(mesh, min_up) >= options.facing_up_share;
  std::vector<Facet> facets;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    facets.push_back(FacetOf(mesh, i));
    if (!is_winding_known) {
      facets.back().up = std::abs(facets.back().up);
    }
  }
  const std::vector<double> decks = UpperDecks(facets, options);
  for (std::size_t i = 0; i < facets.size(); ++i) {
    const auto above =
        std::upper_bound(decks.begin(), decks.end(), facets[i].low_m + options.ramp_margin_m);
    const bool is_road = facets[i].up >= min_up;
    mesh.labels[i] = TruthLabel(is_road ? TruthClass::kRoad : TruthClass::kOtherStructure,
                                static_cast<std::uint32_t>(above - decks.begin()));
  }
}

}  // namespace atlas
