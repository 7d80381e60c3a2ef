#include "core/localization/belief/seen_information.h"

#include <array>
#include <cmath>

#include <Eigen/LU>

namespace atlas {

Eigen::Matrix4d SeenInformation(const RegistrationResult& registration,
                                const CoverAtScan& cover,
                                const std::optional<Eigen::Vector2d>& rival,
                                const SeenOptions& options) {
  constexpr std::array<int, 4> kAxes{0, 1, 2, 5};
  Eigen::Matrix4d seen = options.information_share * registration.information(kAxes, kAxes);
  const double cells =
      cover.map == MapCover::kCoarse ? options.coarse_sigma_cells : options.map_sigma_cells;
  const double place_m = std::hypot(options.map_sigma_m, cells * cover.cell_m);
  const Eigen::Vector4d map_sigmas(place_m, place_m, options.map_sigma_m, options.map_sigma_rad);
  const Eigen::Matrix4d map = map_sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
  seen -= (seen * (seen + map).inverse() * seen).eval();  // of the sum of both covariances
  if (rival) {
    Eigen::Vector4d towards = Eigen::Vector4d::Zero();
    towards.head<2>() = rival->normalized();
    const Eigen::Matrix4d beside = Eigen::Matrix4d::Identity() - towards * towards.transpose();
    seen = (beside * seen * beside).eval();
  }
  return seen;
}

}  // namespace atlas
