// What a map keeps of a real street full of people who walk, a cyclist and a van: the cells that it
// leaves occupied where the vehicle drove, and the share of what stands beside it. One JSON object.
// Usage: street_judge DRIVE TILES
#include <cmath>
#include <exception>
#include <iostream>
#include <set>
#include <utility>

#include "tests/data/street_map.h"
#include "tests/data/street_squares.h"

namespace atlas::testing {
namespace {

constexpr double kSensorHeight_m = 1.73;
constexpr double kCell_m = 0.1;
constexpr int kCellsAMetre = 10;

std::int64_t CellAt(double m) {
  return static_cast<std::int64_t>(std::floor(m / kCell_m));
}

// Cells within a metre of the driven path with a segment 0.5 to 2 m above its road.
std::size_t OccupiedOnPath(const StreetMap& street) {
  std::set<std::pair<std::int64_t, std::int64_t>> occupied;
  for (const DriveScan& scan : street.drive().scans) {
    const Eigen::Vector3d p = scan.T_world_sensor.translation();
    const double road_m = p.z() - kSensorHeight_m;
    for (int dy = -kCellsAMetre; dy <= kCellsAMetre; ++dy) {
      for (int dx = -kCellsAMetre; dx <= kCellsAMetre; ++dx) {
        const auto x = CellAt(p.x()) + dx;
        const auto y = CellAt(p.y()) + dy;
        if (dx * dx + dy * dy <= kCellsAMetre * kCellsAMetre &&
            street.IsOccupied(x, y, road_m + 0.5, road_m + 2.0)) {
          occupied.emplace(x, y);
        }
      }
    }
  }
  return occupied.size();
}

// Where a square is occupied: in a column segment 0.5 to 2 m above the road, or on a surface up to
// there.
struct Kept {
  bool in_column = false;
  bool on_surface = false;
};

Kept FindKept(const StreetMap& street, std::int64_t x, std::int64_t y, double road_m) {
  Kept kept;
  for (int cell = 0; cell < kCellsAMetre * kCellsAMetre; ++cell) {
    const std::int64_t cell_x = x * kCellsAMetre + cell % kCellsAMetre;
    const std::int64_t cell_y = y * kCellsAMetre + cell / kCellsAMetre;
    kept.in_column |= street.IsOccupied(cell_x, cell_y, road_m + 0.5, road_m + 2.0);
    kept.on_surface |= street.IsSurfaceOccupied(cell_x, cell_y, road_m - 2.0, road_m + 2.0);
  }
  return kept;
}

struct Count {
  int squares = 0;
  int in_columns = 0;
  int occupied = 0;  // in columns or on surfaces

  void Add(const Kept& kept) {
    ++squares;
    in_columns += kept.in_column ? 1 : 0;
    occupied += kept.in_column || kept.on_surface ? 1 : 0;
  }
};

std::ostream& operator<<(std::ostream& out, const Count& count) {
  return out << "{\"squares\":" << count.squares << ",\"in_columns\":" << count.in_columns
             << ",\"occupied\":" << count.occupied << '}';
}

void Judge(const StreetMap& street) {
  Count asked;
  Count standing;
  Count moved;
  Count ground;
  for (const auto& [key, square] : JudgeSquares(street)) {
    if (square.is_asked_for()) {
      const Kept kept = FindKept(street, key.first, key.second, square.road_m);
      asked.Add(kept);
      (square.stands() ? standing : square.rises() ? moved : ground).Add(kept);
    }
  }
  std::cout << "{\"occupied_on_path\":" << OccupiedOnPath(street) << ",\"asked\":" << asked
            << ",\"standing\":" << standing << ",\"moved\":" << moved << ",\"ground\":" << ground
            << "}\n";
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: street_judge DRIVE TILES\n";
    return 2;
  }
  try {
    atlas::testing::Judge({argv[1], argv[2], atlas::testing::kSensorHeight_m});
    return 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
