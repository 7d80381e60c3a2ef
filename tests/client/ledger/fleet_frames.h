// What the vehicles of the ledger test send. All of it follows from names and numbers, so that
// whoever reads a ledger knows every byte.
#pragma once

#include <cstdint>

#include "core/base/bytes.h"
#include "core/geometry/keyframe_key.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"

namespace atlas::testing {

// One keyframe of a vehicle.
struct FrameId {
  std::uint32_t session = 0;
  std::uint32_t sequence = 0;

  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 sees a null pointer in <=>
  friend auto operator<=>(const FrameId&, const FrameId&) = default;
};

inline constexpr std::uint32_t kFramesOfASession = 32;
// In every other session of this vehicle one keyframe is far from those beside it.
inline constexpr int kLeapingVehicle = 8;
inline constexpr std::uint32_t kLeapSequence = 6;

MapProfile FleetProfile();  // cells of 0.2 m

bool HasLeap(int vehicle, std::uint32_t session);
SessionKey FleetSession(int vehicle, std::uint32_t session);
KeyframeKey FleetKey(int vehicle, const FrameId& frame);
std::int64_t FleetTime(const FrameId& frame);  // ms since 1970
// Version 0 is the one that it is uploaded with, others are corrections: all differ.
QuantizedPose FleetPose(int vehicle, const FrameId& frame, std::uint32_t version);
Bytes FleetBlob(const KeyframeKey& key);

}  // namespace atlas::testing
