// The four sensors' data sheets.
#include "core/simulation/lidar_sensor.h"

#include <numbers>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

void AddRings(double first_deg, double step_deg, int count, LidarSensor& sensor) {
  for (int i = 0; i < count; ++i) {
    sensor.elevations_rad.push_back((first_deg + i * step_deg) * std::numbers::pi / 180.0);
  }
}

LidarSensor SixteenRings(std::size_t columns) {
  LidarSensor sensor;
  sensor.columns = columns;
  AddRings(-15.0, 2.0, 16, sensor);
  return sensor;
}

LidarSensor Hdl32() {
  LidarSensor sensor;
  AddRings(-30.67, 4.0 / 3.0, 32, sensor);
  return sensor;
}

LidarSensor Hdl64() {
  LidarSensor sensor;
  AddRings(-24.33, 0.5, 32, sensor);
  AddRings(-8.33, 1.0 / 3.0, 32, sensor);
  return sensor;
}

}  // namespace

LidarSensor Vlp16Sensor() {
  return SixteenRings(1800);
}

Result<LidarSensor> LidarSensorByName(std::string_view name) {
  if (name == "vlp16") {
    return Vlp16Sensor();
  }
  if (name == "hdl32") {
    return Hdl32();
  }
  if (name == "hdl64") {
    return Hdl64();
  }
  if (name == "h350") {
    return SixteenRings(350);
  }
  return Error(StatusCode::kInvalidArgument,
               StrCat("sensor '", name, "': expected vlp16, hdl32, hdl64 or h350"));
}

}  // namespace atlas
