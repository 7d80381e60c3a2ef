#include "tests/bench/serving/heavy_frames.h"

#include <random>

#include "core/geometry/tile_id.h"
#include "proto/wire/envelope.h"

namespace atlas::testing {
namespace {

constexpr int kPoses = 262'144;
constexpr std::uint64_t kTiles = 65'536;

// The first of many that nobody has.
std::uint64_t FarOff() {
  return TileId{0, 1 << 20, 1 << 20}.Key();
}

Bytes HoldingMany(std::uint64_t request_id, std::uint64_t radius_um) {
  wire::Envelope request;
  request.set_request_id(request_id);
  wire::SyncRequest& sync = *request.mutable_sync_request();
  sync.mutable_area()->mutable_disc()->set_radius_um(radius_um);
  wire::Held& held = *sync.add_held();
  const std::uint64_t first = FarOff();
  for (std::uint64_t i = 0; i < kTiles; ++i) {
    held.add_keys(first + i);
    held.add_payload_hashes(i);
    held.add_blocks((first >> 6) - 1 - i);
    held.add_masks(1);
    held.add_digests(i);
  }
  return EncodeEnvelopeFrame(request).value();
}

}  // namespace

Bytes WideCorridorFrame(std::uint64_t request_id) {
  constexpr int kPoints = 256;
  constexpr std::int64_t kSide_um = 1'200'000'000;
  wire::Envelope request;
  request.set_request_id(request_id);
  auto& corridor = *request.mutable_sync_request()->mutable_area()->mutable_corridor();
  corridor.set_half_width_um(1'500'000'000);
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> place_um(0, kSide_um);
  for (int i = 0; i < kPoints; ++i) {
    auto& point = *corridor.add_route();
    point.set_x_um(place_um(random));
    point.set_y_um(place_um(random));
  }
  return EncodeEnvelopeFrame(request).value();
}

Bytes ManyPosesFrame(std::uint64_t request_id) {
  wire::Envelope request;
  request.set_request_id(request_id);
  wire::PoseUpdate update;
  update.mutable_key()->set_vehicle("a-vehicle-of-the-crowd");
  update.mutable_key()->set_session("a-session-of-the-crowd");
  update.mutable_pose()->set_x_um(1'000'000'000);
  update.mutable_pose()->set_y_um(1'000'000'000);
  update.mutable_pose()->set_qw(1 << 30);
  auto& updates = *request.mutable_update_poses()->mutable_updates();
  for (int i = 0; i < kPoses; ++i) {
    *updates.Add() = update;
    updates.rbegin()->mutable_key()->set_sequence(static_cast<std::uint32_t>(i));
  }
  updates.rbegin()->mutable_pose()->set_qw(0);
  return EncodeEnvelopeFrame(request).value();
}

Bytes ManyHeldFrame(std::uint64_t request_id) {
  return HoldingMany(request_id, 1'000'000);
}

Bytes ManyHeldInAreaFrame(std::uint64_t request_id) {
  return HoldingMany(request_id, 90'000'000'000'000);
}

Bytes ManyWatchedFrame(std::uint64_t request_id) {
  wire::Envelope request;
  request.set_request_id(request_id);
  auto& tiles = *request.mutable_watch_request()->mutable_area()->mutable_tiles();
  for (std::uint64_t i = 0; i < kTiles; ++i) {
    tiles.add_keys(FarOff() + i);
  }
  return EncodeEnvelopeFrame(request).value();
}

}  // namespace atlas::testing
