#include "tests/bench/localization/street_piece.h"

#include <array>
#include <cstdint>
#include <fstream>

#include <unistd.h>

namespace atlas::testing {

StreetPiece::StreetPiece(const std::string& name, std::size_t first, std::size_t count)
    : folder_(std::filesystem::temp_directory_path() / (name + "_" + std::to_string(::getpid()))) {
  std::filesystem::create_directories(folder_);
  drive_ = DriveFolder{folder_, {}};
  const SimulatedDrive simulated =
      SimulatedDrive::Create(MakeWorld(WorldKind::kStreet).value(), {}).value();
  for (std::size_t i = first; i < first + count; ++i) {
    DriveScan scan;
    scan.number = static_cast<std::uint32_t>(i);
    scan.scan = folder_ / (std::to_string(i) + ".bin");
    scan.T_world_sensor = simulated.sensor_pose(i);
    std::ofstream file(scan.scan, std::ios::binary);
    file.exceptions(std::ios::failbit | std::ios::badbit);
    for (const SimulatedPoint& p : simulated.Scan(i).points) {
      const std::array<float, 4> row{p.x, p.y, p.z, 0.0F};
      file.write(reinterpret_cast<const char*>(row.data()), sizeof(row));
    }
    drive_.scans.push_back(scan);
    const std::vector<TruthBox> moving = simulated.moving_boxes(i);
    traffic_.insert(traffic_.end(), moving.begin(), moving.end());
  }
}

StreetPiece::~StreetPiece() {
  std::error_code ignored;  // what is left is in the folder for what is temporary
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace atlas::testing
