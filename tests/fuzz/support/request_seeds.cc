#include "tests/fuzz/support/request_seeds.h"

#include "proto/wire/convert.h"
#include "tests/fuzz/support/keyframe_packing.h"

namespace atlas::fuzz {
namespace {

wire::Envelope UploadOf(std::uint32_t sequence, const Bytes& blob) {
  wire::Envelope envelope;
  wire::UploadKeyframe& upload = *envelope.mutable_upload_keyframe();
  *upload.mutable_key() = KeyToWire({{"bus", "day"}, sequence});
  upload.set_time_ms(1'000 + 100 * std::int64_t{sequence});
  QuantizedPose pose;
  pose.x_um = 1'500'000 * std::int64_t{sequence};
  pose.z_um = 1'800'000;
  *upload.mutable_pose() = PoseToWire(pose);
  upload.set_blob(BytesToWire(blob));
  return envelope;
}

// A disc, a box, a corridor and tiles.
std::vector<wire::Area> Areas() {
  std::vector<wire::Area> areas(4);
  areas[0].mutable_disc()->mutable_center()->set_x_um(1'500'000);
  areas[0].mutable_disc()->set_radius_um(20'000'000);
  areas[1].mutable_box()->mutable_min()->set_x_um(-5'000'000);
  areas[1].mutable_box()->mutable_min()->set_y_um(-5'000'000);
  areas[1].mutable_box()->mutable_max()->set_x_um(5'000'000);
  areas[1].mutable_box()->mutable_max()->set_y_um(5'000'000);
  for (const std::int64_t x_um : {0, 4'000'000, 9'000'000}) {
    areas[2].mutable_corridor()->add_route()->set_x_um(x_um);
  }
  areas[2].mutable_corridor()->set_half_width_um(3'000'000);
  for (const std::uint64_t key :
       {0x0300000000000000ULL, 0x0300000000000001ULL, 0x0700000000000000ULL}) {
    areas[3].mutable_tiles()->add_keys(key);
  }
  return areas;
}

void AddHeld(wire::SyncRequest& sync) {
  wire::Held& tiles = *sync.add_held();
  tiles.add_sections(2);
  tiles.add_keys(0x0700000000000000);
  tiles.add_payload_hashes(1);
  wire::Held& blocks = *sync.add_held();
  blocks.add_blocks(0x000c000000000000);
  blocks.add_masks(2);
  blocks.add_digests(0x459ad8e8d4cb3ef7);
}

}  // namespace

wire::Envelope HelloSeed(const MapProfile& profile) {
  wire::Envelope envelope;
  envelope.set_request_id(1);
  wire::Hello& hello = *envelope.mutable_hello();
  hello.set_protocol_major(kProtocolMajor);
  hello.set_protocol_minor(kProtocolMinor);
  hello.set_client_name("demo");
  hello.set_profile(ProfileToWire(profile));
  hello.mutable_resume()->set_vehicle("bus");
  hello.mutable_resume()->set_session("day");
  return envelope;
}

std::vector<wire::Envelope> RequestSeeds(const MapProfile& profile) {
  std::vector<wire::Envelope> all;
  std::uint32_t sequence = 0;
  for (const Bytes& blob : KeyframeSeeds(profile)) {
    all.push_back(UploadOf(sequence++, blob));
  }
  wire::PoseUpdate& update = *all.emplace_back().mutable_update_poses()->add_updates();
  *update.mutable_key() = KeyToWire({{"bus", "day"}, 1});
  *update.mutable_pose() = PoseToWire({2'000'000, -1'000'000, 1'800'000, {1 << 30, 0, 0, 0}});
  all.back().mutable_update_poses()->set_author("merge");
  all.back().mutable_update_poses()->set_if_revision(3);
  wire::SessionName& published = *all.back().mutable_update_poses()->add_publish();
  published.set_vehicle("bus");
  published.set_session("day");
  all.emplace_back().mutable_undo_poses()->set_batch(1);
  all.back().mutable_undo_poses()->set_author("merge");
  wire::ChangeSession& change = *all.emplace_back().mutable_change_session();
  change.set_vehicle("bus");
  change.set_session("day");
  change.set_action(wire::ChangeSession::RETRACT);
  change.set_reason("a test");
  wire::QueryRegion& query = *all.emplace_back().mutable_query_region();
  query.mutable_disc()->set_radius_um(30'000'000);
  query.set_budget_bytes(100'000);
  all.emplace_back().mutable_query_region()->set_at_revision(1);
  all.back().mutable_query_region()->set_timeout_ms(20);
  for (const wire::Area& area : Areas()) {
    wire::SyncRequest& sync = *all.emplace_back().mutable_sync_request();
    *sync.mutable_area() = area;
    sync.set_takes_deltas(true);
    AddHeld(sync);
    *all.emplace_back().mutable_watch_request()->mutable_area() = area;
    all.back().mutable_watch_request()->set_interval_ms(50);
  }
  all.emplace_back().mutable_status_request();
  all.emplace_back().mutable_sessions_request();
  all.emplace_back().mutable_sessions_request()->set_changed(true);
  all.emplace_back().mutable_keyframes_request()->set_vehicle("bus");
  all.back().mutable_keyframes_request()->set_session("day");
  wire::ReadKeyframes& read = *all.emplace_back().mutable_read_keyframes();
  read.set_vehicle("bus");
  read.set_session("day");
  read.set_after_sequence(0);
  read.set_budget_bytes(100'000);
  all.emplace_back().mutable_wait_request()->set_timeout_ms(20);
  all.emplace_back().mutable_digest_request()->set_timeout_ms(20);
  all.emplace_back().mutable_verify_request()->set_timeout_ms(20);
  all.emplace_back().mutable_compact_request()->set_timeout_ms(20);
  all.back().mutable_compact_request()->set_before_ms(1'200);
  all.emplace_back().mutable_backup_request()->set_name("monday");
  all.back().mutable_backup_request()->set_timeout_ms(20);
  all.emplace_back().mutable_cancel_request()->set_request_id(9);
  std::uint64_t id = 2;
  for (wire::Envelope& envelope : all) {
    envelope.set_request_id(id++);
  }
  return all;
}

}  // namespace atlas::fuzz
