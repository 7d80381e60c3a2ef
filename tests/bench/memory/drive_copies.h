// A city made of one recorded drive: its keyframes again and again, each time at another place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include "client/connection/atlas_client.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"

namespace atlas::testing {

class DriveCopies {
 public:
  // Its keyframes as they are ingested, of which every `nth` is taken. Errors are those of reading
  // the folder.
  static Result<DriveCopies> Read(const std::filesystem::path& folder,
                                  const MapProfile& profile,
                                  std::size_t nth);

  std::size_t keyframes() const { return keyframes_.size(); }
  // Uploads the copy as the drive of a vehicle of its own (one may begin only so many an hour),
  // acknowledged when this returns. The same number is the same keyframes at the same place, of a
  // square grid that grows outwards.
  Status Upload(AtlasClient& client, std::uint32_t number) const;
  // Where it is.
  Eigen::Vector2d MiddleOf(std::uint32_t number) const;

 private:
  struct Recorded {
    std::uint32_t sequence = 0;
    Pose T_world_sensor = Pose::Identity();
    Bytes blob;
  };

  std::vector<Recorded> keyframes_;
  Eigen::Vector2d middle_m_ = Eigen::Vector2d::Zero();
};

}  // namespace atlas::testing
