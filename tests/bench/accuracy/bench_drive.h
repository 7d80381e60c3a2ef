// The drives that accuracy is measured on, by name.
#pragma once

#include <filesystem>
#include <string_view>

#include "core/base/status.h"
#include "core/simulation/simulated_drive.h"

namespace atlas::testing {

// street, overpass, garage: built in. mesh_garage, mesh_interchange: the meshes of docs/data.md in
// `data`, along the poses of the recorded simulations in them. VLP-16, 2 cm noise. With a suffix:
// _without_cars (built-in worlds): nothing is parked there; _with_traffic: a car ahead and one
// behind on the vehicle's way; _with_car_behind: that one alone.
Result<SimulatedDrive> MakeBenchDrive(std::string_view name, const std::filesystem::path& data);

}  // namespace atlas::testing
