// The drives that accuracy is measured on, by name.
#pragma once

#include <filesystem>
#include <string_view>

#include "core/base/status.h"
#include "core/simulation/simulated_drive.h"

namespace atlas::testing {

// street, overpass, garage: built in; street_without_cars: nothing is parked there, only driven.
// mesh_garage, mesh_interchange: the meshes of docs/data.md in `data`, along the poses of the
// recorded simulations in them. VLP-16, 2 cm noise.
Result<SimulatedDrive> MakeBenchDrive(std::string_view name, const std::filesystem::path& data);

}  // namespace atlas::testing
