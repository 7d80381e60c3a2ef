// The frames that docs/protocol.md prints, in its order, are those that this build writes.
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/geometry/tile_id.h"
#include "proto/wire/convert.h"
#include "proto/wire/envelope.h"
#include "proto/wire/tile_body.h"

namespace atlas {
namespace {

constexpr std::uint64_t kHash = 0x0807'0605'0403'0201;
const Bytes kBlob = {0xaa, 0xbb, 0xcc};

// The two-digit hexadecimal numbers that a line begins with.
void AddLeadingBytes(const std::string& line, Bytes& bytes) {
  std::istringstream words(line);
  for (std::string word; words >> word;) {
    if (word.size() != 2 || word.find_first_not_of("0123456789abcdef") != std::string::npos) {
      return;
    }
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(word, nullptr, 16)));
  }
}

std::vector<Bytes> DocumentedFrames() {
  std::vector<Bytes> frames;
  std::ifstream document(ATLAS_PROTOCOL_DOCUMENT);
  bool is_in_block = false;
  bool is_in_frame = false;
  for (std::string line; std::getline(document, line);) {
    if (line.starts_with("```")) {
      is_in_block = !is_in_block;
      is_in_frame = false;
    } else if (is_in_block && line.starts_with("52 41 46 31")) {
      is_in_frame = true;
      frames.emplace_back();
    }
    if (is_in_frame) {
      AddLeadingBytes(line, frames.back());
    }
  }
  return frames;
}

wire::Envelope Of(std::uint64_t request_id) {
  wire::Envelope envelope;
  envelope.set_request_id(request_id);
  return envelope;
}

wire::Area Around() {
  wire::Area area;
  wire::Area::Disc& disc = *area.mutable_disc();
  disc.mutable_center()->set_x_um(1'500'000);
  disc.mutable_center()->set_y_um(-2'000'000);
  disc.set_radius_um(100'000'000);
  return area;
}

wire::Envelope Hello() {
  wire::Envelope envelope = Of(1);
  envelope.mutable_hello()->set_protocol_major(1);
  envelope.mutable_hello()->set_client_name("demo");
  return envelope;
}

wire::Envelope Sync() {
  wire::Envelope envelope = Of(2);
  wire::SyncRequest& sync = *envelope.mutable_sync_request();
  *sync.mutable_area() = Around();
  sync.add_sections(2);
  sync.set_budget_bytes(65'536);
  wire::Held& held = *sync.add_held();
  held.add_keys(TileId{0, 0, 0}.Key());
  held.add_payload_hashes(0x1122'3344'5566'7788);
  return envelope;
}

wire::Envelope Watch() {
  wire::Envelope envelope = Of(3);
  *envelope.mutable_watch_request()->mutable_area() = Around();
  envelope.mutable_watch_request()->set_interval_ms(1'000);
  return envelope;
}

wire::Envelope Backup() {
  wire::Envelope envelope = Of(5);
  envelope.mutable_backup_request()->set_name("monday");
  envelope.mutable_backup_request()->set_timeout_ms(3'600'000);
  return envelope;
}

wire::Envelope HelloReply() {
  wire::Envelope envelope = Of(1);
  wire::HelloReply& reply = *envelope.mutable_hello_reply();
  reply.set_protocol_major(kProtocolMajor);
  reply.set_protocol_minor(kProtocolMinor);
  reply.set_profile("\x01\x02\x03");
  for (char i = 0; i < 16; ++i) {
    reply.mutable_atlas_id()->push_back(i);
  }
  reply.set_epoch(1);
  reply.set_revision(41);
  reply.set_max_frame_bytes(kMaxFrameBytes);
  reply.set_name("car.7");
  reply.set_role("vehicle");
  reply.set_last_sequence(11);
  return envelope;
}

wire::Envelope Upload() {
  wire::Envelope envelope = Of(4);
  wire::UploadKeyframe& upload = *envelope.mutable_upload_keyframe();
  *upload.mutable_key() = KeyToWire({{"car.7", "monday"}, 12});
  upload.set_time_ms(1'790'000'000'000);
  QuantizedPose pose;
  pose.x_um = 1'500'000;
  pose.y_um = -2'000'000;
  pose.z_um = 1'800'000;
  pose.quaternion = {1 << 30, 0, 0, 0};
  *upload.mutable_pose() = PoseToWire(pose);
  upload.set_blob(BytesToWire(kBlob));
  return envelope;
}

wire::Envelope UploadReply() {
  wire::Envelope envelope = Of(4);
  envelope.mutable_upload_reply()->set_revision(42);
  envelope.mutable_upload_reply()->set_tiles_marked(9);
  return envelope;
}

wire::Envelope Busy() {
  wire::Envelope envelope = Of(4);
  *envelope.mutable_error() = ErrorToWire({StatusCode::kUnavailable, "store: busy"});
  envelope.mutable_error()->set_retry_after_ms(250);
  return envelope;
}

wire::Envelope Sessions() {
  wire::Envelope envelope = Of(5);
  wire::SessionsRequest& sessions = *envelope.mutable_sessions_request();
  sessions.set_after_vehicle("car.7");
  sessions.set_after_session("monday");
  sessions.set_limit(1);
  return envelope;
}

wire::Envelope SessionsReply() {
  wire::Envelope envelope = Of(5);
  wire::SessionInfo& session = *envelope.mutable_sessions_reply()->add_sessions();
  session.set_vehicle("car.7");
  session.set_session("tuesday");
  session.set_state("live");
  session.set_keyframes(2);
  session.set_bytes(300);
  session.set_first_time_ms(1'790'000'000'000);
  session.set_last_time_ms(1'790'000'001'000);
  session.set_last_sequence(1);
  envelope.mutable_sessions_reply()->set_has_more(true);
  return envelope;
}

wire::Envelope Keyframes() {
  wire::Envelope envelope = Of(6);
  wire::KeyframesRequest& keyframes = *envelope.mutable_keyframes_request();
  keyframes.set_vehicle("car.7");
  keyframes.set_session("monday");
  keyframes.set_after_sequence(11);
  return envelope;
}

wire::Envelope KeyframesReply() {
  wire::Envelope envelope = Of(6);
  wire::KeyframeInfo& keyframe = *envelope.mutable_keyframes_reply()->add_keyframes();
  const wire::Envelope uploaded = Upload();
  keyframe.set_sequence(uploaded.upload_keyframe().key().sequence());
  keyframe.set_time_ms(uploaded.upload_keyframe().time_ms());
  *keyframe.mutable_pose() = uploaded.upload_keyframe().pose();
  return envelope;
}

// The first keyframe of a session that is to stay out of the map.
wire::Envelope StagedUpload() {
  wire::Envelope envelope = Upload();
  envelope.set_request_id(7);
  wire::UploadKeyframe& upload = *envelope.mutable_upload_keyframe();
  *upload.mutable_key() = KeyToWire({{"car.7", "tuesday"}, 0});
  upload.set_staged(true);
  return envelope;
}

wire::Envelope Publication() {
  wire::Envelope envelope = Of(8);
  wire::ChangeSession& change = *envelope.mutable_change_session();
  change.set_vehicle("car.7");
  change.set_session("tuesday");
  change.set_action(wire::ChangeSession::PUBLISH);
  return envelope;
}

wire::Envelope ReadKeyframes() {
  wire::Envelope envelope = Of(9);
  wire::ReadKeyframes& read = *envelope.mutable_read_keyframes();
  read.set_vehicle("car.7");
  read.set_session("monday");
  read.set_after_sequence(11);
  read.set_budget_bytes(65'536);
  return envelope;
}

wire::Envelope Keyframe() {
  wire::Envelope envelope = Of(9);
  const wire::Envelope uploaded = Upload();
  wire::KeyframeMessage& keyframe = *envelope.mutable_keyframe();
  keyframe.set_sequence(12);
  keyframe.set_time_ms(uploaded.upload_keyframe().time_ms());
  *keyframe.mutable_pose() = uploaded.upload_keyframe().pose();
  keyframe.mutable_prior()->set_x_um(1'400'000);
  keyframe.mutable_prior()->set_y_um(-2'100'000);
  keyframe.mutable_prior()->set_z_um(1'900'000);
  keyframe.mutable_prior()->set_radius_mm(2'500);
  keyframe.set_blob(BytesToWire(kBlob));
  return envelope;
}

wire::Envelope KeyframesEnd() {
  wire::Envelope envelope = Of(9);
  envelope.mutable_keyframes_end()->set_keyframes(1);
  envelope.mutable_keyframes_end()->set_bytes(96);
  envelope.mutable_keyframes_end()->set_revision(42);
  return envelope;
}

wire::Envelope Correction() {
  wire::Envelope envelope = Of(10);
  wire::UpdatePoses& poses = *envelope.mutable_update_poses();
  wire::PoseUpdate& update = *poses.add_updates();
  *update.mutable_key() = StagedUpload().upload_keyframe().key();
  *update.mutable_pose() = Upload().upload_keyframe().pose();
  poses.set_if_revision(42);
  poses.add_publish()->set_vehicle("car.7");
  poses.mutable_publish(0)->set_session("tuesday");
  return envelope;
}

wire::Envelope CorrectionReply() {
  wire::Envelope envelope = Of(10);
  wire::UpdatePosesReply& reply = *envelope.mutable_update_poses_reply();
  reply.set_updated(1);
  reply.set_tiles_marked(9);
  reply.set_revision(43);
  reply.set_batch(1);
  wire::UpdatePosesReply::SessionChange& session = *reply.add_sessions();
  session.set_vehicle("car.7");
  session.set_session("tuesday");
  session.set_state("live");
  return envelope;
}

wire::Envelope Undoing() {
  wire::Envelope envelope = Of(11);
  envelope.mutable_undo_poses()->set_batch(1);
  return envelope;
}

wire::Envelope Manifest() {
  wire::Envelope envelope = Of(2);
  wire::SyncManifest& manifest = *envelope.mutable_sync_manifest();
  manifest.add_keys(TileId{1, 1, 1}.Key());
  manifest.add_revisions(42);
  manifest.add_payload_hashes(kHash);
  manifest.add_bytes(3);
  manifest.add_errors_mm(200);
  manifest.set_current_tiles("\x01");
  manifest.set_not_modified(1);
  return envelope;
}

Bytes TileFrame() {
  const TileBody body = TileBody::Create({TileId{1, 1, 1}.Key(), 42, kHash, 0}, kBlob).value();
  const Bytes around = body.FrameAround(2);
  ByteWriter frame;
  frame.Raw(ByteSpan(around).first(kFrameHeaderBytes));
  frame.Raw(body.bytes());
  frame.Raw(ByteSpan(around).subspan(kFrameHeaderBytes));
  return frame.Take();
}

wire::Envelope SyncEnd() {
  wire::Envelope envelope = Of(2);
  envelope.mutable_sync_end()->set_tiles(1);
  envelope.mutable_sync_end()->set_bytes(116);
  envelope.mutable_sync_end()->set_revision(42);
  return envelope;
}

TEST(DocumentedFramesTest, AreWhatThisBuildWrites) {
  const auto frame = [](const wire::Envelope& envelope) {
    return EncodeEnvelopeFrame(envelope).value();
  };
  const std::vector<Bytes> written = {frame(Hello()),
                                      frame(Backup()),
                                      frame(Sync()),
                                      frame(Watch()),
                                      frame(HelloReply()),
                                      frame(Upload()),
                                      frame(UploadReply()),
                                      frame(Busy()),
                                      frame(Sessions()),
                                      frame(SessionsReply()),
                                      frame(Keyframes()),
                                      frame(KeyframesReply()),
                                      frame(StagedUpload()),
                                      frame(Publication()),
                                      frame(ReadKeyframes()),
                                      frame(Keyframe()),
                                      frame(KeyframesEnd()),
                                      frame(Correction()),
                                      frame(CorrectionReply()),
                                      frame(Undoing()),
                                      frame(Manifest()),
                                      TileFrame(),
                                      frame(SyncEnd())};
  EXPECT_EQ(DocumentedFrames(), written);
}

}  // namespace
}  // namespace atlas
