#include "core/simulation/gnss_noise.h"

#include <cmath>

#include "core/base/hash_random.h"

namespace atlas {
namespace {

Eigen::Vector3d Draw(HashRandom& random) {
  const double x = random.Gaussian();
  const double y = random.Gaussian();
  const double z = random.Gaussian();
  return {x, y, z};
}

}  // namespace

Status GnssOptions::Validate() const {
  if (!(sigma_m >= 0.001 && sigma_m <= 1000.0)) {
    return {StatusCode::kInvalidArgument, "gnss: sigma is not 0.001 to 1000 m"};
  }
  if (!(wandering >= 0.0 && wandering <= 1.0)) {
    return {StatusCode::kInvalidArgument, "gnss: wandering is not 0 to 1"};
  }
  if (!(wandering_s > 0.0)) {
    return {StatusCode::kInvalidArgument, "gnss: the time of wandering is not above 0"};
  }
  return {};
}

KnownPlaces MeasuredPlaces(std::span<const Pose> T_world_sensor,
                           std::span<const double> times_s,
                           const GnssOptions& options) {
  HashRandom random(options.seed);
  const double wandering_m = std::sqrt(options.wandering) * options.sigma_m;
  const double new_m = std::sqrt(1.0 - options.wandering) * options.sigma_m;
  KnownPlaces places;
  Eigen::Vector3d wandered = Draw(random);  // in its own sigmas
  for (std::size_t i = 0; i < T_world_sensor.size(); ++i) {
    if (i > 0) {
      const double kept = std::exp(-(times_s[i] - times_s[i - 1]) / options.wandering_s);
      wandered = kept * wandered + std::sqrt(1.0 - kept * kept) * Draw(random);
    }
    const Eigen::Vector3d off = wandering_m * wandered + new_m * Draw(random);
    places[static_cast<std::uint32_t>(i)] = {T_world_sensor[i].translation() + off,
                                             options.sigma_m};
  }
  return places;
}

}  // namespace atlas
