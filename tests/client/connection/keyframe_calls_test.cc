// Keyframes read back, and batches of corrections, against peers that answer well and badly.
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "client/connection/atlas_client.h"
#include "proto/wire/convert.h"
#include "tests/client/support/test_peer.h"

namespace atlas {
namespace {

const SessionKey kDay{"bus", "day"};

// The frames of a reply, without their request's id.
using Frames = std::vector<wire::Envelope>;

wire::Envelope Keyframe(std::uint32_t sequence) {
  wire::Envelope envelope;
  wire::KeyframeMessage& keyframe = *envelope.mutable_keyframe();
  keyframe.set_sequence(sequence);
  keyframe.set_time_ms(100 * std::int64_t{sequence});
  QuantizedPose pose;
  pose.x_um = 1'000 * std::int64_t{sequence};
  *keyframe.mutable_pose() = PoseToWire(pose);
  keyframe.set_blob("blob");
  return envelope;
}

wire::Envelope End(std::uint32_t keyframes, std::uint64_t revision, bool has_more = false) {
  wire::Envelope envelope;
  envelope.mutable_keyframes_end()->set_keyframes(keyframes);
  envelope.mutable_keyframes_end()->set_revision(revision);
  envelope.mutable_keyframes_end()->set_has_more(has_more);
  return envelope;
}

// A daemon of protocol 1.`minor` that gives these replies, one a request, and notes the requests.
class ScriptedPeer {
 public:
  ScriptedPeer(std::uint32_t minor, std::vector<Frames> replies)
      : peer_([this, minor, replies = std::move(replies)](PeerSocket& socket) {
          wire::Envelope hello;
          hello.mutable_hello_reply()->set_protocol_major(kProtocolMajor);
          hello.mutable_hello_reply()->set_protocol_minor(minor);
          hello.mutable_hello_reply()->set_profile(ProfileToWire({}));
          socket.Reply(socket.ReadRequest()->request_id(), std::move(hello));
          for (const Frames& frames : replies) {
            const auto request = socket.ReadRequest();
            if (!request) return;
            Note(*request);
            for (const wire::Envelope& frame : frames) {
              socket.Reply(request->request_id(), frame);
            }
          }
          socket.Drain();
        }) {}

  AtlasClient Connect() { return AtlasClient::Connect(peer_.options()).value(); }
  // Of calls that have returned.
  wire::Envelope request(std::size_t i) {
    const std::lock_guard lock(mutex_);
    return requests_.at(i);
  }

 private:
  void Note(const wire::Envelope& request) {
    const std::lock_guard lock(mutex_);
    requests_.push_back(request);
  }

  std::mutex mutex_;
  std::vector<wire::Envelope> requests_;
  TestPeer peer_;
};

Status Nothing(const SessionKeyframe& /*keyframe*/) {
  return {};
}

TEST(KeyframeCallsTest, RepliesFollowEachOtherUntilThereIsNoMore) {
  wire::Envelope first = Keyframe(3);
  wire::PositionPrior& prior = *first.mutable_keyframe()->mutable_prior();
  prior.set_x_um(-5);
  prior.set_radius_mm(2'500);
  wire::Envelope damaged;
  damaged.mutable_keyframe()->set_sequence(7);
  damaged.mutable_keyframe()->set_damage("its row");
  ScriptedPeer peer(11, {{first, Keyframe(4), End(2, 40, true)}, {damaged, End(1, 44)}});
  AtlasClient client = peer.Connect();
  std::vector<SessionKeyframe> came;
  const auto read = client.ReadKeyframes(kDay, 2, [&came](SessionKeyframe keyframe) {
    came.push_back(std::move(keyframe));
    return Status();
  });
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->keyframes, 3U);
  EXPECT_EQ(read->damaged, 1U);
  EXPECT_EQ(read->revision, 40U) << "the first one's: all of it is as new";
  ASSERT_EQ(came.size(), 3U);
  EXPECT_EQ(came[0].prior, (KnownPosition{-5, 0, 0, 2'500}));
  EXPECT_EQ(came[1].T_world_sensor.x_um, 4'000);
  EXPECT_EQ(came[1].blob, (Bytes{'b', 'l', 'o', 'b'}));
  EXPECT_EQ(came[1].time_ms, 400);
  EXPECT_EQ(came[1].prior, std::nullopt);
  EXPECT_EQ(came[2].damage, "its row");
  EXPECT_EQ(peer.request(0).read_keyframes().after_sequence(), 2U);
  EXPECT_EQ(peer.request(1).read_keyframes().after_sequence(), 4U);
}

TEST(KeyframeCallsTest, RepliesThatAreNoneAreRefused) {
  wire::Envelope without_pose = Keyframe(1);
  without_pose.mutable_keyframe()->clear_pose();
  wire::Envelope tile;
  tile.mutable_tile();
  for (const Frames& frames :
       {Frames{Keyframe(2), Keyframe(2), End(2, 1)}, Frames{Keyframe(5), Keyframe(4), End(2, 1)},
        Frames{Keyframe(1), End(2, 1)}, Frames{End(0, 1, true)}, Frames{without_pose, End(1, 1)},
        Frames{tile}}) {
    ScriptedPeer peer(11, {frames});
    AtlasClient client = peer.Connect();
    const auto read = client.ReadKeyframes(kDay, std::nullopt, &Nothing);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code(), StatusCode::kInvalidData) << read.error().message();
    EXPECT_TRUE(client.is_broken());
  }
}

TEST(KeyframeCallsTest, WhoGivesUpMayGoOnWithTheConnection) {
  wire::Envelope status;
  status.mutable_status_reply()->set_revision(9);
  ScriptedPeer peer(11, {{Keyframe(1), Keyframe(2), End(2, 1)}, {status}});
  AtlasClient client = peer.Connect();
  const Status enough(StatusCode::kResourceExhausted, "enough");
  const auto read = client.ReadKeyframes(
      kDay, std::nullopt, [&enough](const SessionKeyframe& /*keyframe*/) { return enough; });
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error(), enough);
  EXPECT_EQ(client.ReadStatus()->revision, 9U);
}

TEST(KeyframeCallsTest, ABatchSaysOnWhatItDependsAndWhatBecameOfIt) {
  wire::Envelope done;
  wire::UpdatePosesReply& reply = *done.mutable_update_poses_reply();
  reply.set_batch(5);
  wire::UpdatePosesReply::SessionChange& session = *reply.add_sessions();
  session.set_vehicle("bus");
  session.set_session("day");
  session.set_state("quarantined");
  session.set_reason("too far");
  ScriptedPeer peer(11, {{done}, {done}});
  AtlasClient client = peer.Connect();
  const PoseCorrection correction{{kDay, 3}, {}};
  const auto batch = client.UpdatePoses({&correction, 1}, "merge", {42, {kDay}});
  ASSERT_TRUE(batch) << batch.error().message();
  EXPECT_EQ(batch->batch, 5U);
  ASSERT_EQ(batch->sessions.size(), 1U);
  EXPECT_EQ(batch->sessions[0].key, kDay);
  EXPECT_EQ(batch->sessions[0].state, "quarantined");
  EXPECT_EQ(batch->sessions[0].reason, "too far");
  EXPECT_EQ(peer.request(0).update_poses().if_revision(), 42U);
  EXPECT_EQ(peer.request(0).update_poses().publish(0).session(), "day");
  ASSERT_TRUE(client.UndoPoses(5, "merge"));
  EXPECT_EQ(peer.request(1).undo_poses().batch(), 5U);
  EXPECT_EQ(peer.request(1).undo_poses().author(), "merge");
}

TEST(KeyframeCallsTest, ADaemonBeforeIsNotAsked) {
  wire::Envelope done;
  done.mutable_update_poses_reply()->set_batch(5);
  ScriptedPeer peer(10, {{done}});
  AtlasClient client = peer.Connect();
  const PoseCorrection correction{{kDay, 3}, {}};
  const std::span<const PoseCorrection> one(&correction, 1);
  EXPECT_EQ(client.UpdatePoses(one, "merge", {42, {}}).error().code(), StatusCode::kUnsupported);
  EXPECT_EQ(client.UpdatePoses(one, "merge", {0, {kDay}}).error().code(), StatusCode::kUnsupported);
  EXPECT_EQ(client.UndoPoses(5, "merge").error().code(), StatusCode::kUnsupported);
  EXPECT_EQ(client.ReadKeyframes(kDay, std::nullopt, &Nothing).error().code(),
            StatusCode::kUnsupported);
  EXPECT_EQ(client.ListSessions({}, SessionDetail::kChanges).error().code(),
            StatusCode::kUnsupported);
  const auto batch = client.UpdatePoses(one, "merge");
  ASSERT_TRUE(batch) << "as ever: " << batch.error().message();
  EXPECT_TRUE(batch->sessions.empty());
}

}  // namespace
}  // namespace atlas
