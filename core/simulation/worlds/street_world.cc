// A residential street: two lanes, a parking strip, curb, sidewalk and gardens on either side.
#include <array>
#include <numbers>

#include "core/base/hash_random.h"
#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/props.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas {
namespace {

constexpr double kStraight_m = 80.0;
constexpr double kBeyond_m = 40.0;  // the street goes on where the drive ends
constexpr double kCurveRadius_m = 45.0;

constexpr double kLaneEdge_m = 3.0;
constexpr double kCurb_m = 5.0;
constexpr double kCurbHeight_m = 0.12;
constexpr double kSidewalkEdge_m = 8.0;
constexpr double kGardenEdge_m = 34.0;
constexpr double kLane_m = -1.6;  // traffic keeps to the right

DrivePath Centreline(double beyond_m) {
  DrivePath path({{-beyond_m, 0.0, 0.0}, 0.0});
  path.Straight(kStraight_m + beyond_m)
      .Turn(kCurveRadius_m, std::numbers::pi / 2.0)
      .Straight(kStraight_m + beyond_m);
  return path;
}

void AddGround(const DrivePath& street, MeshBuilder& out) {
  constexpr std::uint32_t kRoad = TruthLabel(TruthClass::kRoad);
  constexpr std::uint32_t kParking = TruthLabel(TruthClass::kParking);
  constexpr std::uint32_t kSidewalk = TruthLabel(TruthClass::kSidewalk);
  constexpr std::uint32_t kTerrain = TruthLabel(TruthClass::kTerrain);
  constexpr std::array<ProfileCorner, 10> profile = {{
      {kGardenEdge_m, kCurbHeight_m, kTerrain},
      {kSidewalkEdge_m, kCurbHeight_m, kSidewalk},
      {kCurb_m, kCurbHeight_m, kSidewalk},  // the curb's face
      {kCurb_m, 0.0, kParking},
      {kLaneEdge_m, 0.0, kRoad},
      {-kLaneEdge_m, 0.0, kParking},
      {-kCurb_m, 0.0, kSidewalk},
      {-kCurb_m, kCurbHeight_m, kSidewalk},
      {-kSidewalkEdge_m, kCurbHeight_m, kTerrain},
      {-kGardenEdge_m, kCurbHeight_m, 0},
  }};
  out.Extrude(street, profile);
}

// Side +1 is the left of the street, -1 the right.
PathPoint Beside(const DrivePath& street, double along_m, double side, double away_m) {
  PathPoint point = street.At(along_m, side * away_m);
  point.position.z() = away_m > kCurb_m ? kCurbHeight_m : 0.0;
  // y of the frame points away from the street.
  point.yaw_rad += side > 0.0 ? 0.0 : std::numbers::pi;
  return point;
}

void AddPlots(const DrivePath& street, double side, HashRandom& random, MeshBuilder& out) {
  for (const double along_m : EvenlySpaced(8.0, street.length_m() - 8.0, 17.0)) {
    const double front_m = random.Uniform(11.5, 15.0);
    const HouseSize size{random.Uniform(8.0, 12.0), random.Uniform(7.0, 10.0),
                         random.Uniform(3.5, 7.5)};
    AddHouse(FrameAt(Beside(street, along_m + random.Uniform(-1.5, 1.5), side, front_m)), size,
             out);
    if (random.Below(3) != 0) {
      out.Box({{-5.0, 0.0, 0.0}, {3.0, 0.1, 1.0}},
              FrameAt(Beside(street, along_m, side, kSidewalkEdge_m + 1.0)),
              TruthLabel(TruthClass::kFence));
    }
  }
}

void AddFurniture(const DrivePath& street, double side, HashRandom& random, MeshBuilder& out) {
  double tree_m = 5.0;
  while (tree_m < street.length_m()) {
    AddTree(Beside(street, tree_m, side, 7.4).position, random.Uniform(1.2, 2.0), out);
    tree_m += random.Uniform(11.0, 19.0);
  }
  for (const double along_m : EvenlySpaced(12.0, street.length_m(), 26.0)) {
    AddPole(Beside(street, along_m + 6.0 * side, side, 5.5).position, 7.0, 0, out);
  }
  for (const double along_m : EvenlySpaced(30.0, street.length_m(), 55.0)) {
    AddSign(FrameAt(Beside(street, along_m + 9.0 * side, side, 5.6)), out);
  }
}

// Every other slot of the parking strip is always taken; the rest are the drive's.
void AddParkedCars(const DrivePath& street,
                   double side,
                   HashRandom& random,
                   MeshBuilder& out,
                   std::vector<ParkedSlot>& free_slots) {
  for (const double along_m : EvenlySpaced(4.0, street.length_m(), 6.5)) {
    PathPoint stall = Beside(street, along_m, side, 4.0);
    stall.position.z() = 0.0;
    if (random.Below(2) == 0) {
      out.Append(CarMesh(TruthLabel(TruthClass::kCar)), FrameAt(stall));
    } else {
      free_slots.push_back({FrameAt(stall), 0});
    }
  }
}

}  // namespace

SimulatedWorld MakeStreetWorld() {
  SimulatedWorld world;
  const DrivePath street = Centreline(kBeyond_m);
  MeshBuilder builder;
  HashRandom random(0x57524545);
  AddGround(street, builder);
  for (const double side : {1.0, -1.0}) {
    AddPlots(street, side, random, builder);
    AddFurniture(street, side, random, builder);
    AddParkedCars(street, side, random, builder, world.parked_slots);
  }
  world.mesh = builder.Take();
  world.legs.push_back(Centreline(0.0));
  world.lane_left_m = kLane_m;
  const TriangleMesh car = CarMesh(TruthLabel(TruthClass::kMovingCar));
  const TriangleMesh person = PersonMesh(TruthLabel(TruthClass::kMovingPerson));
  world.traffic = {{car, 0, false, 16.0, 5.3, kLane_m},
                   {car, 0, true, 40.0, 6.0, kLane_m},
                   {car, 0, true, 0.0, 4.0, kLane_m},
                   {person, 0, false, 45.0, 1.4, -6.3}};
  return world;
}

}  // namespace atlas
