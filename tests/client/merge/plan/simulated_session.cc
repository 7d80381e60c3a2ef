#include "tests/client/merge/plan/simulated_session.h"

#include "core/base/hash.h"
#include "core/keyframe/keyframe_codec.h"

namespace atlas::testing {

SimulatedSession::SimulatedSession(const std::string& vehicle,
                                   const DrivePiece& piece,
                                   const Pose& T_frame_world) {
  const DrivenKeyframes driven = DriveThrough(piece, MapProfile());
  session_.key = {vehicle, "drive"};
  truth_ = driven.truth;
  parked_ = driven.parked;
  for (std::size_t i = 0; i < driven.keyframes.size(); ++i) {
    const auto sequence = static_cast<std::uint32_t>(piece.first + i);
    blobs_->push_back(EncodeKeyframe(*driven.keyframes[i]));
    session_.keyframes.push_back({sequence, 250 * static_cast<std::int64_t>(sequence),
                                  QuantizedPose::FromPose(T_frame_world * driven.T_world_sensor[i]),
                                  std::nullopt, Hash64(blobs_->back())});
  }
}

BlobReader SimulatedSession::reader() const {
  return [blobs = blobs_](std::size_t i) -> Result<Bytes> {
    return (*blobs)[i];
  };
}

Pose SimulatedSession::TruthOf(const MergeSession& fused, std::size_t submap) const {
  const MergeSubmap& one = fused.submaps[submap];
  return truth_[one.middle()] * (fused.T_world_sensor[one.middle()].inverse() * one.T_world_submap);
}

}  // namespace atlas::testing
