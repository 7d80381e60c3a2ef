// What one drive meets that the world does not hold: participants that move, and cars that are
// parked in this drive only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/pose.h"
#include "core/simulation/drive_path.h"
#include "core/simulation/mesh/static_world.h"
#include "core/simulation/truth_box.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas {

// Where the vehicle is, and since when on this leg.
struct DriveMoment {
  Pose T_world_sensor = Pose::Identity();
  std::size_t leg = 0;
  double leg_time_s = 0.0;
  double along_m = 0.0;  // of the leg
  // Of cars ahead or behind on the same way: x forward, on the ground, tilted as it is.
  std::vector<Pose> T_world_convoy = {};
};

struct TrafficOptions {
  std::uint64_t seed = 0;         // of the participants' delays: 0 none, else up to 8 m
  std::uint64_t parked_seed = 0;  // of the slots that are taken: 0 none, else every other one
};

class Traffic {
 public:
  // `legs` and `oncoming_legs` as the vehicle drives them, and against it.
  Traffic(std::vector<TrafficParticipant> participants,
          std::vector<DrivePath> legs,
          std::vector<DrivePath> oncoming_legs,
          const std::vector<ParkedSlot>& slots,
          const TrafficOptions& options);

  // Everything that moves within `radius_m` of the vehicle, at one moment. A participant that would
  // be where the vehicle is (a loop brings it there) is not on the road for that moment.
  std::vector<TruthBox> MovingBoxes(const DriveMoment& moment, double radius_m) const;
  const std::vector<TruthBox>& parked_boxes() const { return parked_boxes_; }

  // What stands within `radius_m` of the vehicle and is not the world's, relative to `origin`.
  CastableMesh MeshAround(const DriveMoment& moment,
                          double radius_m,
                          const Eigen::Vector3d& origin) const;

 private:
  struct Placed {
    std::size_t participant = 0;
    Eigen::Isometry3d T_world_participant;
  };
  std::vector<Placed> PlacedAt(const DriveMoment& moment) const;

  TrafficOptions options_;
  std::vector<TrafficParticipant> participants_;  // the last one is any car of the convoy
  std::vector<DrivePath> legs_;
  std::vector<DrivePath> oncoming_legs_;
  std::vector<TruthBox> participant_boxes_;  // in the participants' frames
  std::vector<TruthBox> parked_boxes_;
  std::vector<ParkedSlot> parked_;
};

}  // namespace atlas
