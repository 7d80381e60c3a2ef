// Some scans of the simulated street as a recorded drive on disk; gone with its owner.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "core/scan/drive_folder.h"
#include "core/simulation/simulated_drive.h"

namespace atlas::testing {

class StreetPiece {
 public:
  // Scans [first, first + count). `name`: of the folder, and of this process. Throws where the disk
  // or the simulation fails.
  StreetPiece(const std::string& name, std::size_t first, std::size_t count);
  ~StreetPiece();
  StreetPiece(const StreetPiece&) = delete;
  StreetPiece& operator=(const StreetPiece&) = delete;

  const DriveFolder& drive() const { return drive_; }
  // What moved, of all scans.
  const std::vector<TruthBox>& traffic() const { return traffic_; }

 private:
  std::filesystem::path folder_;
  DriveFolder drive_;
  std::vector<TruthBox> traffic_;
};

}  // namespace atlas::testing
