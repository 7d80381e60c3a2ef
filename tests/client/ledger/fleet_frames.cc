#include "tests/client/ledger/fleet_frames.h"

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {
namespace {

constexpr std::int32_t kRadius_cells = 10;
constexpr std::int64_t kMetre_um = 1'000'000;

}  // namespace

MapProfile FleetProfile() {
  MapProfile profile;
  profile.cell_size_um = 200'000;
  return profile;
}

bool HasLeap(int vehicle, std::uint32_t session) {
  return vehicle == kLeapingVehicle && session % 2 == 0;
}

SessionKey FleetSession(int vehicle, std::uint32_t session) {
  return {StrCat("car", vehicle), StrCat("s", session)};
}

KeyframeKey FleetKey(int vehicle, const FrameId& frame) {
  return {FleetSession(vehicle, frame.session), frame.sequence};
}

std::int64_t FleetTime(const FrameId& frame) {
  return 1'700'000'000'000 + 1'000'000 * std::int64_t{frame.session} + 100 * frame.sequence;
}

// Sessions are 32 m long and begin 16 m apart, roads lie 3 m apart: every tile is several sessions'
// and several vehicles', and none is everybody's.
QuantizedPose FleetPose(int vehicle, const FrameId& frame, std::uint32_t version) {
  QuantizedPose pose;
  pose.x_um = (16 * std::int64_t{frame.session} + frame.sequence) * kMetre_um;
  pose.y_um = 3 * std::int64_t{vehicle} * kMetre_um;
  pose.z_um = 2 * kMetre_um;
  // Up to 2 m along and across, and a micrometre a version so that no two are alike.
  pose.x_um += 400'000 * (version * 7 % 11) + version;
  pose.y_um += 300'000 * (version * 5 % 7);
  if (HasLeap(vehicle, frame.session) && frame.sequence == kLeapSequence) {
    pose.y_um += 3'000 * kMetre_um;
  }
  return pose;
}

Bytes FleetBlob(const KeyframeKey& key) {
  const std::string name = StrCat(key);
  const auto seed = static_cast<std::uint32_t>(Hash64(Bytes(name.begin(), name.end())));
  return EncodeKeyframe(StreetKeyframe(FleetProfile(), kRadius_cells, seed));
}

}  // namespace atlas::testing
