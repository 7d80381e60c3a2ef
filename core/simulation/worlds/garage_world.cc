// A multi-storey car park. In plan (metres): the building is 52 x 28, the ramps lie above each
// other in a bay in the middle, each rising east; the aisle runs west along y = 10, so that a drive
// climbs a ramp, turns around in the east, comes back in the aisle and turns into the next ramp.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/hash_random.h"
#include "core/base/str_cat.h"
#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/props.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas {
namespace {

constexpr double kWest_m = -26.0;
constexpr double kEast_m = 26.0;
constexpr double kSouth_m = -10.0;
constexpr double kNorth_m = 18.0;
constexpr double kSouthStalls_m = -5.0;  // stalls lie beyond
constexpr double kNorthStalls_m = 13.0;
constexpr double kAisle_m = 10.0;
constexpr double kBayX_m = 11.0;  // half the bay
constexpr double kBayY_m = 2.6;
constexpr double kSlab_m = 0.3;
constexpr double kParapet_m = 1.1;
constexpr double kEntryHalf_m = 3.2;   // gap in the east wall of the lowest deck
constexpr double kTransition_m = 2.5;  // at half the slope, at both ends of a ramp
constexpr double kPillarStep_m = 8.0;
constexpr double kYard_m = 80.0;

struct Deck {
  std::uint32_t number = 0;
  double z_m = 0.0;
  double height_m = 0.0;
  bool is_roof = false;

  double ceiling_m() const { return z_m + height_m - kSlab_m; }
  std::uint32_t Label(TruthClass truth_class) const { return TruthLabel(truth_class, number); }
};

struct PlanRect {
  double x0, x1, y0, y1;
};

void AddRamp(DrivePath& path, double rise_m) {
  const double middle_m = 2.0 * kBayX_m - 2.0 * kTransition_m;
  const double slope = rise_m / (middle_m + kTransition_m);
  path.Straight(kTransition_m, 0.5 * slope * kTransition_m)
      .Straight(middle_m, slope * middle_m)
      .Straight(kTransition_m, 0.5 * slope * kTransition_m);
}

// The driven floor, and stalls north and south of it.
void AddFloor(const Deck& deck, const PlanRect& rect, MeshBuilder& out) {
  const std::array<double, 4> cuts = {kSouth_m, kSouthStalls_m, kNorthStalls_m, kNorth_m};
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double y0 = std::max(rect.y0, cuts[i]);
    const double y1 = std::min(rect.y1, cuts[i + 1]);
    if (y0 >= y1) {
      continue;
    }
    const auto floor_class = i == 1 ? TruthClass::kRoad : TruthClass::kParking;
    out.Floor({{rect.x0, y0, deck.z_m}, {rect.x1, y1, deck.z_m}}, deck.Label(floor_class));
  }
  if (deck.number > 0) {
    out.Box({{rect.x0, rect.y0, deck.z_m - kSlab_m}, {rect.x1, rect.y1, deck.z_m - 0.01}},
            deck.Label(TruthClass::kBuilding));
  }
}

void AddSlab(const Deck& deck, MeshBuilder& out) {
  if (deck.number == 0) {
    AddFloor(deck, {kWest_m, kEast_m, kSouth_m, kNorth_m}, out);
    return;
  }
  AddFloor(deck, {kWest_m, -kBayX_m, kSouth_m, kNorth_m}, out);
  AddFloor(deck, {kBayX_m, kEast_m, kSouth_m, kNorth_m}, out);
  AddFloor(deck, {-kBayX_m, kBayX_m, kBayY_m, kNorth_m}, out);
  AddFloor(deck, {-kBayX_m, kBayX_m, kSouth_m, -kBayY_m}, out);
}

void AddWall(const Deck& deck, const PlanRect& rect, double top_m, MeshBuilder& out) {
  out.Box({{rect.x0, rect.y0, deck.z_m}, {rect.x1, rect.y1, top_m}},
          deck.Label(TruthClass::kBuilding));
}

void AddOuterWalls(const Deck& deck, MeshBuilder& out) {
  const double low_m = deck.z_m + kParapet_m;
  const double full_m = deck.is_roof ? low_m : deck.ceiling_m();
  AddWall(deck, {kWest_m, kEast_m, kNorth_m, kNorth_m + 0.2}, full_m, out);
  AddWall(deck, {kWest_m, kEast_m, kSouth_m - 0.2, kSouth_m}, low_m, out);
  AddWall(deck, {kWest_m - 0.2, kWest_m, kSouth_m, kNorth_m}, low_m, out);
  if (deck.number > 0) {
    AddWall(deck, {kEast_m, kEast_m + 0.2, kSouth_m, kNorth_m}, low_m, out);
  } else {
    AddWall(deck, {kEast_m, kEast_m + 0.2, kSouth_m, kAisle_m - kEntryHalf_m}, low_m, out);
    AddWall(deck, {kEast_m, kEast_m + 0.2, kAisle_m + kEntryHalf_m, kNorth_m}, low_m, out);
  }
  // The stairwell, higher than the roof.
  AddWall(deck, {kEast_m - 5.0, kEast_m, kSouth_m, kSouth_m + 5.0}, deck.z_m + deck.height_m, out);
}

// Parapets around the bay, where the floor ends; on the roof also in the west, where no ramp
// leaves.
void AddBayWalls(const Deck& deck, MeshBuilder& out) {
  if (deck.number == 0) {
    return;
  }
  const double top_m = deck.z_m + kParapet_m;
  AddWall(deck, {-kBayX_m, kBayX_m, kBayY_m, kBayY_m + 0.15}, top_m, out);
  AddWall(deck, {-kBayX_m, kBayX_m, -kBayY_m - 0.15, -kBayY_m}, top_m, out);
  if (deck.is_roof) {
    AddWall(deck, {-kBayX_m - 0.15, -kBayX_m, -kBayY_m, kBayY_m}, top_m, out);
  }
}

void AddPillars(const Deck& deck, MeshBuilder& out) {
  if (deck.is_roof) {
    return;
  }
  const auto pillar = [&](double x, double y) {
    AddWall(deck, {x - 0.2, x + 0.2, y - 0.2, y + 0.2}, deck.ceiling_m(), out);
  };
  for (const double x : EvenlySpaced(-3.0 * kPillarStep_m, kEast_m, kPillarStep_m)) {
    pillar(x, kNorthStalls_m + 1.0);
    pillar(x, kSouthStalls_m);
    if (std::abs(x) <= kPillarStep_m) {
      pillar(x, 6.2);
    }
  }
}

void AddParkedCars(const Deck& deck, MeshBuilder& out) {
  HashRandom random(0x6A2A6E, deck.number);
  for (const double x : EvenlySpaced(-22.0, 22.5, 2.75)) {
    const bool is_at_pillar = std::abs(std::remainder(x, kPillarStep_m)) < 1.3;
    for (const double y : {kNorth_m - 2.5, kSouth_m + 2.5}) {
      const bool is_at_stairs = y < 0.0 && x > 19.0;
      if (is_at_pillar || is_at_stairs || random.Below(100) >= 45) {
        continue;
      }
      const double yaw_rad =
          random.Below(2) == 0 ? std::numbers::pi / 2.0 : -std::numbers::pi / 2.0;
      out.Append(CarMesh(deck.Label(TruthClass::kCar)), FrameAt({{x, y, deck.z_m}, yaw_rad}));
    }
  }
}

// The ramp from `deck` to the next; the lowest one is closed down to the ground.
void AddRampStructure(const Deck& deck, MeshBuilder& out) {
  const std::uint32_t road = deck.Label(TruthClass::kRoad);
  const std::uint32_t wall = deck.Label(TruthClass::kBuilding);
  const double inner_m = kBayY_m - 0.15;
  const double top_m = 0.9;
  const std::array<ProfileCorner, 9> profile = {{
      {kBayY_m, -kSlab_m, wall},
      {kBayY_m, top_m, wall},
      {inner_m, top_m, wall},
      {inner_m, 0.0, road},
      {-inner_m, 0.0, wall},
      {-inner_m, top_m, wall},
      {-kBayY_m, top_m, wall},
      {-kBayY_m, -kSlab_m, wall},
      {kBayY_m, -kSlab_m, 0},
  }};
  DrivePath ramp({{-kBayX_m, 0.0, deck.z_m}, 0.0});
  AddRamp(ramp, deck.height_m);
  out.Extrude(ramp, profile);
  if (deck.number == 0) {
    for (const double y : {-kBayY_m, kBayY_m}) {
      out.Quad({-kBayX_m, y, 0.0}, {kBayX_m, y, 0.0}, {kBayX_m, y, deck.height_m},
               {-kBayX_m, y, 0.0}, wall);
    }
  }
}

void AddYard(MeshBuilder& out) {
  const std::uint32_t ground = TruthLabel(TruthClass::kOtherGround);
  out.Floor({{-kYard_m, kNorth_m, 0.0}, {kYard_m, kYard_m, 0.0}}, ground);
  out.Floor({{-kYard_m, -kYard_m, 0.0}, {kYard_m, kSouth_m, 0.0}}, ground);
  out.Floor({{-kYard_m, kSouth_m, 0.0}, {kWest_m, kNorth_m, 0.0}}, ground);
  out.Floor({{kEast_m, kSouth_m, 0.0}, {kYard_m, kNorth_m, 0.0}}, ground);
  HashRandom random(0x9A2D);
  for (const double side : {-1.0, 1.0}) {
    for (const double x : EvenlySpaced(-60.0, 61.0, 24.0)) {
      AddHouse(FrameAt({{x + random.Uniform(-4.0, 4.0), side * random.Uniform(38.0, 50.0), 0.0},
                        side > 0.0 ? 0.0 : std::numbers::pi}),
               {random.Uniform(9.0, 15.0), 10.0, random.Uniform(6.0, 18.0)}, out);
      AddTree({x + 9.0, side * random.Uniform(27.0, 32.0), 0.0}, random.Uniform(1.4, 2.4), out);
    }
  }
}

DrivePath ClimbingDrive(const GarageOptions& options) {
  constexpr double kRadius_m = kAisle_m / 2.0;
  constexpr double kPi = std::numbers::pi;
  DrivePath path({{kEast_m + 6.0, kAisle_m, 0.0}, kPi});
  path.Straight(kEast_m + 6.0 - kBayX_m);
  for (std::size_t deck = 0; deck + 1 < options.decks; ++deck) {
    path.Straight(2.0 * kBayX_m).Turn(kRadius_m, kPi);
    AddRamp(path, options.deck_height_m);
    path.Turn(kRadius_m, kPi);
  }
  path.Straight(2.0 * kBayX_m);
  return path;
}

Status Validate(const GarageOptions& options) {
  if (options.decks < 2 || options.decks > 20) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("garage: ", options.decks, " decks, expected 2 to 20"));
  }
  if (!(options.deck_height_m >= 2.6 && options.deck_height_m <= 3.5)) {
    return Status(
        StatusCode::kInvalidArgument,
        StrCat("garage: deck height ", options.deck_height_m, " m, expected 2.6 m to 3.5 m"));
  }
  return {};
}

}  // namespace

Result<SimulatedWorld> MakeGarageWorld(const GarageOptions& options) {
  if (Status status = Validate(options); !status.ok()) {
    return Error(std::move(status));
  }
  SimulatedWorld world;
  MeshBuilder builder;
  AddYard(builder);
  for (std::size_t i = 0; i < options.decks; ++i) {
    const Deck deck{static_cast<std::uint32_t>(i), static_cast<double>(i) * options.deck_height_m,
                    options.deck_height_m, i + 1 == options.decks};
    AddSlab(deck, builder);
    AddOuterWalls(deck, builder);
    AddBayWalls(deck, builder);
    AddPillars(deck, builder);
    AddParkedCars(deck, builder);
    if (!deck.is_roof) {
      AddRampStructure(deck, builder);
    }
  }
  world.mesh = builder.Take();
  world.legs.push_back(ClimbingDrive(options));
  world.lane_left_m = -0.4;
  return world;
}

}  // namespace atlas
