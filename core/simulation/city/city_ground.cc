// Heights from passes, and polygons cut by distance.
#include "core/simulation/city/city_ground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/simulation/truth_label.h"

namespace atlas {
namespace {

constexpr double kSoft_m = 3.0;  // heights are smoothed over so much

struct Corner {
  Eigen::Vector3d p;
  double street_m = 0.0;
};
using Polygon = std::vector<Corner>;

// The ground between two distances from a pass.
struct Strip {
  double from_m;
  double to_m;
  double up_m;
  TruthClass truth_class;
};
constexpr double kFar_m = 1e9;
constexpr std::array<Strip, 4> kStrips = {{
    {-1.0, CityStreet::kLaneEdge_m, 0.0, TruthClass::kRoad},
    {CityStreet::kLaneEdge_m, CityStreet::kCurb_m, 0.0, TruthClass::kParking},
    {CityStreet::kCurb_m, CityStreet::kSidewalkEdge_m, CityStreet::kCurbHeight_m,
     TruthClass::kSidewalk},
    {CityStreet::kSidewalkEdge_m, kFar_m, CityStreet::kCurbHeight_m, TruthClass::kTerrain},
}};

double DistanceToSegment(const Eigen::Vector2d& p,
                         const Eigen::Vector2d& a,
                         const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double squared = along.squaredNorm();
  const double t = squared > 0.0 ? std::clamp((p - a).dot(along) / squared, 0.0, 1.0) : 0.0;
  return (a + t * along - p).norm();
}

// Where the edge crosses the distance. From the nearer corner, so that both neighbours of an edge
// find the same point.
Corner Crossing(const Corner& a, const Corner& b, double street_m) {
  const Corner& near = a.street_m < b.street_m ? a : b;
  const Corner& far = a.street_m < b.street_m ? b : a;
  const double t = (street_m - near.street_m) / (far.street_m - near.street_m);
  return {near.p + t * (far.p - near.p), street_m};
}

// The part of a convex polygon on one side of a distance (Sutherland and Hodgman 1974).
Polygon Cut(const Polygon& polygon, double street_m, bool is_nearer_kept) {
  const auto is_kept = [&](const Corner& corner) {
    return is_nearer_kept ? corner.street_m <= street_m : corner.street_m > street_m;
  };
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner& a = polygon[i];
    const Corner& b = polygon[(i + 1) % polygon.size()];
    if (is_kept(a)) {
      kept.push_back(a);
    }
    if (is_kept(a) != is_kept(b)) {
      kept.push_back(Crossing(a, b, street_m));
    }
  }
  return kept;
}

void AddFan(const Polygon& polygon, double up_m, std::uint32_t label, MeshBuilder& out) {
  const Eigen::Vector3d up(0.0, 0.0, up_m);
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    out.Triangle(polygon[0].p + up, polygon[i - 1].p + up, polygon[i].p + up, label);
  }
}

void AddCurbFace(const Polygon& triangle, MeshBuilder& out) {
  std::array<Eigen::Vector3d, 3> ends;
  std::size_t count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Corner& a = triangle[i];
    const Corner& b = triangle[(i + 1) % 3];
    if ((a.street_m <= CityStreet::kCurb_m) != (b.street_m <= CityStreet::kCurb_m)) {
      ends[count++] = Crossing(a, b, CityStreet::kCurb_m).p;
    }
  }
  if (count == 2) {
    const Eigen::Vector3d up(0.0, 0.0, CityStreet::kCurbHeight_m);
    out.Quad(ends[0], ends[1], ends[1] + up, ends[0] + up, TruthLabel(TruthClass::kSidewalk));
  }
}

void AddGroundTriangle(const Polygon& triangle, MeshBuilder& out) {
  const bool is_ground = std::all_of(triangle.begin(), triangle.end(), [](const Corner& corner) {
    return corner.street_m < CityStreet::kEdge_m;
  });
  if (!is_ground) {
    return;
  }
  for (const Strip& strip : kStrips) {
    const Polygon part = Cut(Cut(triangle, strip.from_m, false), strip.to_m, true);
    AddFan(part, strip.up_m, TruthLabel(strip.truth_class), out);
  }
  AddCurbFace(triangle, out);
}

}  // namespace

CityGround::CityGround(const CityPath& path, const Eigen::AlignedBox2d& square)
    : path_(path), square_(square), near_(path.NodesNear(square)) {}

GroundPoint CityGround::At(const Eigen::Vector2d& p) const {
  constexpr double kReach2 = CityPath::kReach_m * CityPath::kReach_m;
  GroundPoint point;
  point.street_m = std::numeric_limits<double>::infinity();
  double weights = 0.0;
  double heights = 0.0;
  for (const std::uint32_t i : near_) {
    const CityNode& node = path_.nodes()[i];
    const Eigen::Vector2d a = node.ground.head<2>();
    const double squared = (a - p).squaredNorm();
    if (squared >= kReach2) {
      continue;
    }
    const Eigen::Vector2d b = node.is_last ? a : path_.nodes()[i + 1].ground.head<2>();
    point.street_m = std::min(point.street_m, DistanceToSegment(p, a, b));
    const double fade = 1.0 - squared / kReach2;
    const double near = squared + kSoft_m * kSoft_m;
    const double weight = fade * fade / (near * near);
    weights += weight;
    heights += weight * node.ground.z();
  }
  point.road_z_m = weights > 0.0 ? heights / weights : 0.0;
  return point;
}

void CityGround::AddMesh(const Eigen::Vector3d& origin, MeshBuilder& out) const {
  const Eigen::Vector2i size = square_.sizes().array().round().cast<int>();
  const auto row = [&](int y) {
    std::vector<Corner> corners;
    for (int x = 0; x <= size.x(); ++x) {
      const Eigen::Vector2d p = square_.min() + Eigen::Vector2d(x, y);
      const GroundPoint point = At(p);
      corners.push_back({Eigen::Vector3d(p.x(), p.y(), point.road_z_m) - origin, point.street_m});
    }
    return corners;
  };
  std::vector<Corner> below = row(0);
  for (int y = 1; y <= size.y(); ++y) {
    std::vector<Corner> above = row(y);
    for (std::size_t x = 1; x < below.size(); ++x) {
      AddGroundTriangle({below[x - 1], below[x], above[x]}, out);
      AddGroundTriangle({below[x - 1], above[x], above[x - 1]}, out);
    }
    below = std::move(above);
  }
}

}  // namespace atlas
