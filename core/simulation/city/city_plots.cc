// Slots along each side of the way; each draws from a stream of its own, so that a thing is the
// same whichever chunk is asked first.
#include "core/simulation/city/city_plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/base/hash_random.h"
#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/props.h"

namespace atlas {
namespace {

enum class PlotKind : std::uint64_t { kHouse = 1, kFence, kTree, kPole, kSign, kParked };

struct Plot {
  PathPoint front;  // on the pass; y of its frame leads away from the street on its side
  HashRandom random;
};

// The least and greatest distance from a pass, and heights, over points of a frame.
struct Footing {
  double nearest_m = std::numeric_limits<double>::infinity();
  double farthest_m = 0.0;
  double low_m = std::numeric_limits<double>::infinity();
  double high_m = -std::numeric_limits<double>::infinity();
};

Footing FootingOf(const CityGround& ground,
                  const Eigen::Isometry3d& frame,
                  const Eigen::AlignedBox2d& outline) {
  Footing footing;
  for (int i = 0; i < 25; ++i) {
    const Eigen::Vector2d at =
        outline.min() + outline.sizes().cwiseProduct(Eigen::Vector2d(i % 5, i / 5) / 4.0);
    const GroundPoint point = ground.At((frame * Eigen::Vector3d(at.x(), at.y(), 0.0)).head<2>());
    footing.nearest_m = std::min(footing.nearest_m, point.street_m);
    footing.farthest_m = std::max(footing.farthest_m, point.street_m);
    footing.low_m = std::min(footing.low_m, point.z_m());
    footing.high_m = std::max(footing.high_m, point.z_m());
  }
  return footing;
}

// A frame `away_m` from the middle of the street, at the height of the ground.
Eigen::Isometry3d FrameBeside(const Plot& plot, double away_m, const CityGround& ground) {
  Eigen::Isometry3d frame = FrameAt(plot.front);
  frame.translation() = frame * Eigen::Vector3d(0.0, away_m, 0.0);
  frame.translation().z() = ground.At(frame.translation().head<2>()).z_m();
  return frame;
}

// Calls `use` for each slot of `step_m` that begins at a node of the chunk, on both sides.
template <typename Use>
void ForEachPlot(
    const CityPath& path, const CityChunk& chunk, PlotKind kind, double step_m, const Use& use) {
  for (const std::uint32_t i : path.NodesIn(chunk)) {
    const CityNode& node = path.nodes()[i];
    const bool is_start = node.along_m == 0.0;
    const double slot = std::floor(node.along_m / step_m);
    const bool begins = is_start || slot != std::floor(path.nodes()[i - 1].along_m / step_m);
    if (!node.is_first_pass || !begins) {
      continue;
    }
    for (const double turn_rad : {0.0, std::numbers::pi}) {
      const auto side = static_cast<std::uint64_t>(turn_rad > 0.0 ? 1 : 0);
      const std::uint64_t place =
          (std::uint64_t{node.leg} << 40) | (static_cast<std::uint64_t>(slot) << 1) | side;
      use(Plot{{node.ground, node.yaw_rad + turn_rad},
               HashRandom(0xC17, static_cast<std::uint64_t>(kind), place)});
    }
  }
}

// A front of bays, every other one set back, under one flat roof.
void AddHouseFront(const Eigen::Isometry3d& frame,
                   const HouseSize& size,
                   HashRandom& random,
                   MeshBuilder& out) {
  constexpr double kBay_m = 2.6;
  const std::uint32_t label = TruthLabel(TruthClass::kBuilding);
  const int bays = std::max(1, static_cast<int>(size.width_m / kBay_m));
  const double width_m = size.width_m / bays;
  for (int bay = 0; bay < bays; ++bay) {
    const double left_m = -0.5 * size.width_m + bay * width_m;
    const double back_m = bay % 2 == 0 ? 0.0 : random.Uniform(0.4, 1.2);
    out.Box({{left_m, back_m, 0.0}, {left_m + width_m, size.depth_m, size.height_m}}, frame, label);
  }
}

void AddHouses(const Plot& from,
               const CityGround& ground,
               MeshBuilder& out,
               const Eigen::Vector3d& origin) {
  Plot plot = from;
  const HouseSize size{plot.random.Uniform(9.0, 15.0), plot.random.Uniform(7.0, 10.0),
                       plot.random.Uniform(4.0, 14.0)};
  Eigen::Isometry3d frame = FrameBeside(plot, plot.random.Uniform(10.5, 14.0), ground);
  const Footing footing = FootingOf(ground, frame,
                                    {Eigen::Vector2d(-0.5 * size.width_m, 0.0),
                                     Eigen::Vector2d(0.5 * size.width_m, size.depth_m)});
  if (footing.nearest_m < CityStreet::kSidewalkEdge_m + 1.0) {
    return;
  }
  frame.translation().z() = footing.low_m - 0.3;
  frame.translation() -= origin;
  const double height_m = size.height_m + footing.high_m - footing.low_m;
  AddHouseFront(frame, {size.width_m, size.depth_m, height_m}, plot.random, out);
}

void AddFence(const Plot& from,
              const CityGround& ground,
              MeshBuilder& out,
              const Eigen::Vector3d& origin) {
  Plot plot = from;
  Eigen::Isometry3d frame = FrameBeside(plot, CityStreet::kSidewalkEdge_m + 0.8, ground);
  const Footing footing =
      FootingOf(ground, frame, {Eigen::Vector2d(-4.0, 0.0), Eigen::Vector2d(3.0, 0.1)});
  if (plot.random.Below(3) == 0 || footing.nearest_m < CityStreet::kSidewalkEdge_m + 0.2) {
    return;
  }
  frame.translation().z() = footing.low_m - 0.1;
  frame.translation() -= origin;
  out.Box({{-4.0, 0.0, 0.0}, {3.0, 0.1, 1.1 + footing.high_m - footing.low_m}}, frame,
          TruthLabel(TruthClass::kFence));
}

// Trees, poles and signs: thin, on the sidewalk.
void AddUpright(PlotKind kind,
                const Plot& from,
                const CityGround& ground,
                MeshBuilder& out,
                const Eigen::Vector3d& origin) {
  Plot plot = from;
  const double away_m = kind == PlotKind::kTree ? 7.2 : CityStreet::kCurb_m + 0.4;
  Eigen::Isometry3d frame = FrameBeside(plot, away_m, ground);
  if (ground.At(frame.translation().head<2>()).street_m < CityStreet::kCurb_m + 0.2) {
    return;
  }
  frame.translation() -= origin + Eigen::Vector3d(0.0, 0.0, 0.05);
  if (kind == PlotKind::kTree) {
    AddTree(frame.translation(), plot.random.Uniform(1.2, 2.0), out);
  } else if (kind == PlotKind::kPole) {
    AddPole(frame.translation(), 7.0, 0, out);
  } else {
    AddSign(frame, out);
  }
}

// A car in the parking strip beside a plot, where there is room for one.
std::optional<Eigen::Isometry3d> CarFrame(const Plot& plot, const CityGround& ground) {
  constexpr double kMiddle_m = 0.5 * (CityStreet::kLaneEdge_m + CityStreet::kCurb_m);
  const Eigen::Isometry3d frame = FrameBeside(plot, kMiddle_m, ground);
  const Footing footing =
      FootingOf(ground, frame, {Eigen::Vector2d(-2.2, -0.9), Eigen::Vector2d(2.2, 0.9)});
  if (footing.nearest_m < CityStreet::kLaneEdge_m || footing.farthest_m > CityStreet::kCurb_m) {
    return std::nullopt;
  }
  return frame;
}

// Of four slots two are always taken, one is the drive's, one stays free.
std::uint32_t ParkedDraw(const Plot& plot) {
  HashRandom random = plot.random;
  return random.Below(4);
}

template <typename Use>
void ForEachParkedPlot(const CityPath& path, const CityChunk& chunk, const Use& use) {
  ForEachPlot(path, chunk, PlotKind::kParked, 6.5, use);
}

}  // namespace

void AddPlots(const CityPath& path,
              const CityChunk& chunk,
              const CityGround& ground,
              const Eigen::Vector3d& origin,
              MeshBuilder& out) {
  ForEachPlot(path, chunk, PlotKind::kHouse, 16.0,
              [&](const Plot& plot) { AddHouses(plot, ground, out, origin); });
  ForEachPlot(path, chunk, PlotKind::kFence, 9.0,
              [&](const Plot& plot) { AddFence(plot, ground, out, origin); });
  constexpr std::array<std::pair<PlotKind, double>, 3> kUprights = {
      {{PlotKind::kTree, 13.0}, {PlotKind::kPole, 27.0}, {PlotKind::kSign, 57.0}}};
  for (const auto& [kind, step_m] : kUprights) {
    ForEachPlot(path, chunk, kind, step_m, [&, upright = kind](const Plot& plot) {
      AddUpright(upright, plot, ground, out, origin);
    });
  }
  ForEachParkedPlot(path, chunk, [&](const Plot& plot) {
    const auto frame = CarFrame(plot, ground);
    if (frame && ParkedDraw(plot) < 2) {
      Eigen::Isometry3d in_part = *frame;
      in_part.translation() -= origin;
      out.Append(CarMesh(TruthLabel(TruthClass::kCar)), in_part);
    }
  });
}

void AddParkedSlots(const CityPath& path,
                    const CityChunk& chunk,
                    const CityGround& ground,
                    std::vector<ParkedSlot>& slots) {
  ForEachParkedPlot(path, chunk, [&](const Plot& plot) {
    const auto frame = CarFrame(plot, ground);
    if (frame && ParkedDraw(plot) == 2) {
      slots.push_back({*frame, 0});
    }
  });
}

}  // namespace atlas
