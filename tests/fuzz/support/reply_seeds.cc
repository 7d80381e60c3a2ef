#include "tests/fuzz/support/reply_seeds.h"

#include <string>

#include "core/base/hash.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_container.h"
#include "core/tile/tile_delta.h"
#include "proto/wire/convert.h"
#include "tests/fuzz/support/tile_packing.h"

namespace atlas::fuzz {
namespace {

constexpr std::uint64_t kSyncId = 2;

wire::Envelope HelloReply() {
  wire::Envelope envelope;
  envelope.set_request_id(1);
  wire::HelloReply& hello = *envelope.mutable_hello_reply();
  hello.set_protocol_major(kProtocolMajor);
  hello.set_protocol_minor(kProtocolMinor);
  hello.set_profile(ProfileToWire(TileProfile()));
  hello.set_atlas_id(std::string(16, 'a'));
  hello.set_epoch(1);
  hello.set_revision(7);
  hello.set_max_frame_bytes(kMaxFrameBytes);
  hello.set_name("bus");
  hello.set_role("vehicle");
  hello.set_last_sequence(3);
  return envelope;
}

wire::TileMessage TileOf(std::uint64_t key, const Bytes& blob, std::uint64_t payload_hash) {
  wire::TileMessage tile;
  tile.set_key(key);
  tile.set_revision(5);
  tile.set_payload_hash(payload_hash);
  tile.set_blob(BytesToWire(blob));
  return tile;
}

// A tile as a whole, and the held one as a delta to what is held.
std::vector<wire::TileMessage> Tiles() {
  const HeldSeed held = HeldTileSeed();
  Tile changed = DecodeTile(held.blob, TileProfile()).value();
  changed.layers[5].altitude_mm -= 1;
  const EncodedTile target = EncodeTile(changed, TileProfile());
  std::vector<wire::TileMessage> tiles{
      TileOf(held.key, EncodeTileDelta(held.blob, target.blob).value(), target.payload_hash)};
  tiles[0].set_base_hash(held.payload_hash);
  const Bytes other = TileSeeds()[1];
  tiles.insert(tiles.begin(), TileOf(DecodeContainer(other)->key, other,
                                     Hash64(TilePayloadFromBlob(other).value())));
  return tiles;
}

std::vector<wire::Envelope> SyncReply() {
  std::vector<wire::Envelope> frames(1);
  wire::SyncManifest& manifest = *frames[0].mutable_sync_manifest();
  for (const wire::TileMessage& tile : Tiles()) {
    manifest.add_keys(tile.key());
    manifest.add_revisions(tile.revision());
    manifest.add_payload_hashes(tile.payload_hash());
    manifest.add_bytes(static_cast<std::uint32_t>(tile.blob().size()));
    manifest.add_errors_mm(200);
    *frames.emplace_back().mutable_tile() = tile;
  }
  manifest.add_removed(HeldTileSeed().key);
  manifest.add_differing_blocks(0x000c000000000000);
  wire::SyncEnd& end = *frames.emplace_back().mutable_sync_end();
  end.set_tiles(2);
  end.set_revision(9);
  end.set_cursor("on");
  end.set_bytes(1 << 13);  // as long as the right number is
  std::uint64_t bytes = 0;
  for (wire::Envelope& frame : frames) {
    frame.set_request_id(kSyncId);
    bytes += EncodeEnvelopeFrame(frame)->size();
  }
  frames.back().mutable_sync_end()->set_bytes(bytes);
  return frames;
}

}  // namespace

HeldSeed HeldTileSeed() {
  Bytes blob = TileSeeds()[0];
  return {DecodeContainer(blob)->key, Hash64(TilePayloadFromBlob(blob).value()), std::move(blob)};
}

std::vector<wire::Envelope> ReplySeeds() {
  std::vector<wire::Envelope> all{HelloReply()};
  for (wire::Envelope& frame : SyncReply()) {
    all.push_back(std::move(frame));
  }
  std::uint64_t id = kSyncId;
  const auto next = [&all, &id]() -> wire::Envelope& {
    all.emplace_back().set_request_id(++id);
    return all.back();
  };
  *next().mutable_tile() = Tiles()[0];
  all.emplace_back().set_request_id(id);
  all.back().mutable_query_end()->set_tiles(1);
  next().mutable_status_reply()->set_revision(9);
  wire::SessionInfo& session = *next().mutable_sessions_reply()->add_sessions();
  session.set_vehicle("bus");
  session.set_session("day");
  session.set_state("live");
  wire::KeyframeInfo& keyframe = *next().mutable_keyframes_reply()->add_keyframes();
  keyframe.set_sequence(1);
  *keyframe.mutable_pose() = PoseToWire({1'000'000, 0, 1'800'000, {1 << 30, 0, 0, 0}});
  next().mutable_wait_reply()->set_revision(9);
  next().mutable_digest_reply()->set_sha256(std::string(32, 'd'));
  next().mutable_verify_reply()->add_findings("none");
  next().mutable_compact_reply()->set_dropped(1);
  next().mutable_backup_reply()->set_stage(wire::BackupReply::DONE);
  next().mutable_change_session_reply()->set_state("retracted");
  wire::UpdatePosesReply& corrected = *next().mutable_update_poses_reply();
  corrected.set_updated(1);
  corrected.add_sessions()->set_state("live");
  wire::KeyframeMessage& read = *next().mutable_keyframe();
  read.set_sequence(1);
  *read.mutable_pose() = PoseToWire({1'000'000, 0, 1'800'000, {1 << 30, 0, 0, 0}});
  read.mutable_prior()->set_radius_mm(2'500);
  read.set_blob("abc");
  all.emplace_back().set_request_id(id);
  all.back().mutable_keyframe()->set_sequence(2);
  all.back().mutable_keyframe()->set_damage("its row");
  all.emplace_back().set_request_id(id);
  all.back().mutable_keyframes_end()->set_keyframes(2);
  next().mutable_update_poses_reply()->set_batch(2);
  next().mutable_upload_reply()->set_revision(10);
  wire::Error& error = *next().mutable_error();
  error.set_code(static_cast<int>(StatusCode::kUnavailable));
  error.set_message("busy");
  error.set_retry(true);
  error.set_retry_after_ms(1);
  return all;
}

}  // namespace atlas::fuzz
