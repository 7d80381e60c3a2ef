// Requests as the daemon reads them, from the payload of a frame to the service's types, and what
// the service makes of those that change nothing.
#include <utility>

#include "proto/wire/convert.h"
#include "server/net/requests/region_reply.h"
#include "server/net/requests/request_conversion.h"
#include "server/net/requests/sync_conversion.h"
#include "server/net/requests/watch_reply.h"
#include "tests/fuzz/support/frame_packing.h"
#include "tests/fuzz/support/request_seeds.h"
#include "tests/fuzz/support/tiny_atlas.h"

namespace atlas::fuzz {
namespace {

constexpr int kMaxTiles = 64;

TinyAtlas& Atlas() {
  static TinyAtlas atlas;
  return atlas;
}

std::vector<Bytes> Seeds() {
  std::vector<Bytes> seeds{BytesOf(HelloSeed(TinyAtlas::Profile()).SerializeAsString())};
  for (const wire::Envelope& request : RequestSeeds(TinyAtlas::Profile())) {
    seeds.push_back(BytesOf(request.SerializeAsString()));
  }
  return seeds;
}

bool TryUpload(const wire::UploadKeyframe& message) {
  auto upload = UploadFromWire(message);
  if (!upload) {
    return false;
  }
  const auto keyframe = Atlas().service().CheckUpload(*std::move(upload));
  if (!keyframe) {
    return false;
  }
  Require(keyframe->time_ms >= 0 && keyframe->time_ms <= TinyAtlas::kNow_ms + kMaxTimeAhead_ms,
          "a time is one that can have been");
  Require(!keyframe->footprint.empty(), "a keyframe touches tiles");
  for (const TileId& tile : keyframe->footprint) {
    const auto id = TileId::FromKey(tile.Key());
    Require(id && *id == tile, "a footprint is of tiles that there are");
  }
  return true;
}

bool TryPoses(const wire::UpdatePoses& message) {
  const auto poses = PosesFromWire(message);
  for (const auto& update : poses ? poses->updates : std::vector<PoseBatchRequest::Update>()) {
    Require(update.key.Validate().ok() && update.pose.Validate().ok(),
            "what is converted is valid");
  }
  return poses.has_value();
}

bool TryQuery(const wire::QueryRegion& message) {
  const auto region = RegionFromWire(message);
  if (!region || region->at_revision) {
    return region.has_value();
  }
  RegionQuery::Options options;
  options.tile_cost = [](const StoredTile& tile) {
    return tile.blob.size();
  };
  auto query = Atlas().service().Query(*region, std::move(options));
  for (int i = 0; query && i < kMaxTiles; ++i) {
    const auto tile = Atlas().service().NextTile(*query);
    Require(tile.has_value(), "no tile is damaged");
    if (!*tile) {
      break;
    }
  }
  return query.has_value();
}

bool TrySync(const wire::SyncRequest& message) {
  const auto request = SyncFromWire(message, Atlas().service().identity());
  if (!request) {
    return false;
  }
  const auto plan = Atlas().service().PlanSync(*request, true);
  if (!plan) {
    return false;
  }
  wire::SyncManifest manifest;
  HoldingsToWire(**plan, manifest);
  return true;
}

bool TryWatch(const wire::WatchRequest& message) {
  auto order = WatchFromWire(message, TinyAtlas::Profile());
  if (!order) {
    return false;
  }
  const auto watch = Atlas().service().Watch(std::move(order->scope), [] {});
  if (!watch) {
    return false;
  }
  (*watch)->Add({0, 1, -1}, 7);
  (*watch)->Add({3, 0, 0}, 8);
  (*watch)->Take();
  return true;
}

bool Run(ByteSpan payload) {
  const auto envelope = ParseEnvelope(payload);
  IsSmallBesidesBlobs(payload, 1'024);
  if (!envelope) {
    return false;
  }
  const auto again = ParseEnvelope(BytesFromWire(envelope->SerializeAsString()));
  Require(again.has_value(), "what was parsed parses again");
  switch (envelope->body_case()) {
    case wire::Envelope::kHello:
      return CheckHello(*envelope, TinyAtlas::Profile()).ok();
    case wire::Envelope::kUploadKeyframe:
      return TryUpload(envelope->upload_keyframe());
    case wire::Envelope::kUpdatePoses:
      return TryPoses(envelope->update_poses());
    case wire::Envelope::kChangeSession: {
      const auto change = SessionChangeFromWire(envelope->change_session());
      return change && CheckSessionChange(*change).ok();
    }
    case wire::Envelope::kQueryRegion:
      return TryQuery(envelope->query_region());
    case wire::Envelope::kSyncRequest:
      return TrySync(envelope->sync_request());
    case wire::Envelope::kWatchRequest:
      return TryWatch(envelope->watch_request());
    default:
      return true;  // numbers, which the service looks at: fuzz_server.cc
  }
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  return MutateEnvelope(input, max_size, random, &MutateWireBlob);
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
