// What is asked of a simulation on the command line, and the drive that answers it.
#pragma once

#include <cstdint>
#include <string>

#include "client/cli/command_line/argument_set.h"
#include "core/base/status.h"
#include "core/simulation/simulated_drive.h"

namespace atlas {

class SimulationRequest {
 public:
  void Declare(ArgumentSet& arguments);

  // kInvalidArgument for a world, sensor or combination that there is none of; else as the files
  // that are read say.
  Result<SimulatedDrive> MakeDrive() const;

 private:
  Result<DriveOptions> Options() const;
  Status NoFreeSlots() const;
  Status HasTraffic() const;
  Result<SimulatedDrive> DriveBuiltIn(const DriveOptions& options) const;
  Result<SimulatedDrive> DriveAnyCity(const DriveOptions& options) const;
  Result<SimulatedDrive> DriveMesh(const DriveOptions& options) const;

  bool is_mesh() const;
  bool is_city() const { return world_ == "city"; }

  std::string world_;
  std::string sensor_ = "vlp16";
  std::string trajectory_;
  double revolution_s_ = 0.0;
  double every_m_ = 0.0;
  std::uint64_t seed_ = 0;
  std::uint64_t parked_seed_ = 0;
  bool has_traffic_ = false;
};

}  // namespace atlas
