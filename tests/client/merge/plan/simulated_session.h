// A piece of a simulated drive as a session to be merged, and where it truly is.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/merge/plan/merge_session.h"
#include "client/merge/plan/submap_builder.h"
#include "core/simulation/truth_box.h"
#include "tests/core/support/simulated_keyframes.h"

namespace atlas::testing {

class SimulatedSession {
 public:
  // Its poses are those of a frame of its own, in which the world's lies at `T_frame_world`.
  SimulatedSession(const std::string& vehicle,
                   const DrivePiece& piece,
                   const Pose& T_frame_world = Pose::Identity());

  // As it is stored: in the map, without submaps.
  const MergeSession& session() const { return session_; }
  // Of its blobs; valid without it.
  BlobReader reader() const;
  const std::vector<TruthBox>& parked() const { return parked_; }
  const std::vector<Pose>& truth() const { return truth_; }  // T_world_sensor by keyframe
  // T_world_submap of one of `fused`, this session with submaps.
  Pose TruthOf(const MergeSession& fused, std::size_t submap) const;

 private:
  MergeSession session_;
  std::vector<Pose> truth_;
  std::vector<TruthBox> parked_;
  std::shared_ptr<std::vector<Bytes>> blobs_ = std::make_shared<std::vector<Bytes>>();
};

}  // namespace atlas::testing
