// Requests that take long to be read, for their size: the others on their thread do not wait, and
// all kinds are answered as if they were small.
#include <algorithm>
#include <chrono>
#include <future>
#include <map>
#include <memory>
#include <vector>

#include "server/store/tile_block.h"
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;

class LargeRequestTest : public NetTest {
 protected:
  // Corrections of keyframes that nobody knows, the last one impossible: refused when all of it is
  // read.
  static wire::Envelope PosesOf(std::uint64_t id, int count) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    auto& updates = *envelope.mutable_update_poses()->mutable_updates();
    wire::PoseUpdate update;
    *update.mutable_key() = KeyToWire({{"a-bus-with-a-long-name", "a-day-with-a-long-name"}, 1});
    *update.mutable_pose() = PoseToWire(PoseOf(PoseAlong(1)));
    for (int i = 0; i < count; ++i) {
      *updates.Add() = update;
    }
    updates.rbegin()->mutable_pose()->set_qw(0);
    updates.rbegin()->mutable_pose()->set_qz(0);
    return envelope;
  }
  // Around 0/0/0, and as many held as there may be, none of which is there.
  static wire::Envelope SyncOf(std::uint64_t id, bool is_large) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    wire::SyncRequest& sync = *envelope.mutable_sync_request();
    sync.mutable_area()->mutable_disc()->set_radius_um(1'000'000'000);
    wire::Held& held = *sync.add_held();
    const std::uint64_t far_off = TileId{0, 1 << 20, 1 << 20}.Key();
    for (std::uint64_t i = 0; is_large && i < HeldTiles::kMaxTiles; ++i) {
      held.add_keys(far_off + i);
      held.add_payload_hashes(i);
      held.add_blocks(TileBlockOf(far_off) - 1 - i);
      held.add_masks(1);
      held.add_digests(i);
    }
    return envelope;
  }
  // Answered where it is read.
  static wire::Envelope CancelOf(std::uint64_t id) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    envelope.mutable_cancel_request()->set_request_id(99);
    return envelope;
  }
  // The longest that small requests of another peer wait until `large` is answered.
  Clock::duration LongestWaitDuring(const wire::Envelope& large, Clock::duration& all) {
    const auto peer = Connect();
    const auto other = Connect();
    const Bytes frame = EncodeEnvelopeFrame(large).value();
    auto reply = std::async(std::launch::async, [&] {
      peer->SendBytes(frame);
      const auto begin = Clock::now();
      EXPECT_TRUE(peer->Receive().has_value());
      all = Clock::now() - begin;
    });
    Clock::duration longest{};
    while (reply.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
      const auto begin = Clock::now();
      other->Send(CancelOf(5));
      EXPECT_TRUE(other->Receive().has_value());
      longest = std::max(longest, Clock::now() - begin);
    }
    return longest;
  }
  // The tiles that a sync brings, by key.
  static std::map<std::uint64_t, std::uint64_t> Sync(BlockingPeer& peer, bool is_large) {
    std::map<std::uint64_t, std::uint64_t> tiles;
    peer.Send(SyncOf(7, is_large));
    for (auto reply = peer.Receive(); reply && !reply->has_sync_end(); reply = peer.Receive()) {
      EXPECT_FALSE(reply->has_error()) << reply->error().message();
      if (reply->has_tile()) {
        tiles[reply->tile().key()] = reply->tile().payload_hash();
      }
    }
    return tiles;
  }
  // The same, of so many bytes, by a field that the daemon does not know.
  static wire::Envelope Padded(wire::Envelope envelope, std::size_t bytes) {
    auto* const unknown = envelope.GetReflection()->MutableUnknownFields(&envelope);
    auto* const padding = unknown->AddLengthDelimited(1'000);
    padding->assign(bytes - envelope.ByteSizeLong(), 'x');
    padding->resize(padding->size() -
                    (envelope.ByteSizeLong() - bytes));  // its size has bytes, too
    return envelope;
  }
  static StatusCode LastWords(BlockingPeer& peer) {
    const auto reply = peer.Receive();
    EXPECT_TRUE(reply.has_value());
    EXPECT_TRUE(peer.IsClosed());
    return CodeOf(reply);
  }
};

TEST_F(LargeRequestTest, OthersOnItsThreadDoNotWaitForIt) {
  net_.threads = 1;
  Serve();
  Clock::duration all{};
  const auto longest = LongestWaitDuring(PosesOf(1, 200'000), all);
  EXPECT_LT(longest, all / 3);
}

TEST_F(LargeRequestTest, PosesAreCheckedToTheLastOne) {
  Serve();
  const auto peer = Connect();
  peer->Send(PosesOf(4, 50'000));
  const auto reply = peer->Receive();
  EXPECT_EQ(CodeOf(reply), StatusCode::kInvalidData);
  EXPECT_EQ(reply->request_id(), 4u);
  wire::Envelope unknown = PosesOf(5, 50'000);
  unknown.mutable_update_poses()->mutable_updates()->RemoveLast();
  peer->Send(unknown);
  EXPECT_NE(CodeOf(peer->Receive()), StatusCode::kOk) << "one keyframe named twice, and unknown";
  peer->Send(CancelOf(6));  // by then the others are over
  EXPECT_TRUE(peer->Receive()->has_cancel_reply());
  ExpectHoldsNothing();
}

// Poses take more room than they do on their way.
TEST_F(LargeRequestTest, CountsAsWhatIsMadeOfIt) {
  wire::Envelope poses = PosesOf(4, 100'000);
  for (wire::PoseUpdate& update : *poses.mutable_update_poses()->mutable_updates()) {
    *update.mutable_key() = KeyToWire({{"a", "b"}, 1});
    *update.mutable_pose() = PoseToWire(QuantizedPose());
  }
  net_.max_held_bytes = 2 * (kFrameHeaderBytes + poses.ByteSizeLong());
  Serve();
  const auto peer = Connect();
  peer->Send(poses);
  const auto reply = peer->Receive();
  EXPECT_EQ(CodeOf(reply), StatusCode::kResourceExhausted);
  EXPECT_EQ(reply->request_id(), 4u);
  peer->Send(CancelOf(5));
  EXPECT_TRUE(peer->Receive()->has_cancel_reply()) << "the connection goes on";
  ExpectHoldsNothing();
}

// Groups of held tiles without a tile: two bytes each on their way, a hundred and more in memory.
TEST_F(LargeRequestTest, ASmallOneCountsAsWhatItUnfoldsTo) {
  constexpr std::size_t kUnfoldedBytes = 700'000;
  net_.max_held_bytes = 3 * kUnfoldedBytes;
  Serve(0);  // nothing is ever fused: whoever waits for a revision holds his request
  UploadDrive(1);
  wire::Envelope sync = SyncOf(7, false);
  for (int i = 0; i < 7'000; ++i) {
    sync.mutable_sync_request()->add_held();
  }
  sync.mutable_sync_request()->set_wait_revision(1);
  sync.mutable_sync_request()->set_timeout_ms(60'000);
  ASSERT_LT(sync.ByteSizeLong(), net_.large_frame_bytes);
  const auto waiting = Connect();
  waiting->Send(sync);
  EXPECT_TRUE(WaitFor([](const NetFigures& now) { return now.held_bytes > kUnfoldedBytes; }));
  const auto others = Connect();
  std::size_t refused = 0;
  for (std::uint64_t id = 8; id < 11; ++id) {
    sync.set_request_id(id);
    others->Send(sync);
    others->Send(CancelOf(100 + id));
    const auto reply = others->Receive();
    refused += CodeOf(reply) == StatusCode::kResourceExhausted ? 1U : 0U;
    if (!reply->has_cancel_reply()) {
      EXPECT_TRUE(others->Receive()->has_cancel_reply()) << "the connection goes on";
    }
  }
  EXPECT_GT(refused, 0U);
}

// A keyframe that there was no room for is missing, as one that was refused later would be: those
// behind it wait for it.
TEST_F(LargeRequestTest, BehindAKeyframeWithoutRoomNothingIsTaken) {
  net_.max_held_bytes = 256u << 10;
  net_.copied_frame_bytes = 0;
  Serve(0);  // nothing is ever fused: whoever waits for that holds his request
  UploadDrive(1);
  std::vector<std::unique_ptr<BlockingPeer>> waiting;
  for (int i = 0; i < 10; ++i) {
    waiting.push_back(Connect());
    waiting.back()->Send(Padded(WaitOf(2, 60'000), 15'000));
  }
  ExpectHolds(10 * (15'000 + kFrameHeaderBytes));
  const auto peer = Connect();
  wire::Envelope large = UploadOf(1, 3);
  large.mutable_upload_keyframe()->mutable_blob()->resize(80'000);
  peer->Send(large);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kResourceExhausted);
  peer->Send(UploadOf(2, 4));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kUnavailable);
  for (std::uint32_t i = 1; i < 3; ++i) {
    peer->Send(UploadOf(i, 5));
    const auto reply = peer->Receive();
    EXPECT_TRUE(reply && reply->has_upload_reply()) << i;
  }
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 3U);
}

TEST_F(LargeRequestTest, ASyncThatTellsMuchGetsWhatASmallOneGets) {
  Serve();
  UploadDrive(6);
  Digest();
  const auto peer = Connect();
  const auto small = Sync(*peer, false);
  EXPECT_FALSE(small.empty());
  EXPECT_EQ(Sync(*peer, true), small);
}

TEST_F(LargeRequestTest, EveryKindIsAnsweredAsIfItWereSmall) {
  net_.large_frame_bytes = 1;
  net_.copied_frame_bytes = 0;
  Serve();
  const auto peer = Connect();
  for (std::uint32_t i = 0; i < 6; ++i) {  // without waiting in between: in their order
    peer->Send(UploadOf(i, 10 + i));
  }
  for (std::uint32_t i = 0; i < 6; ++i) {
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply && reply->has_upload_reply());
    EXPECT_EQ(reply->request_id(), 10 + i);
  }
  Digest();
  EXPECT_FALSE(Sync(*peer, false).empty());
  peer->Send(StatusOf(20));
  EXPECT_EQ(peer->Receive()->status_reply().keyframes(), 6u);
  wire::Envelope poses;
  poses.set_request_id(21);
  wire::PoseUpdate& update = *poses.mutable_update_poses()->add_updates();
  *update.mutable_key() = KeyToWire(DriveUpload(2).key);
  *update.mutable_pose() = PoseToWire(PoseOf(PoseAlong(3)));
  poses.mutable_update_poses()->set_author("tester");
  peer->Send(poses);
  EXPECT_EQ(peer->Receive()->update_poses_reply().updated(), 1u);
  wire::Envelope watch;
  watch.set_request_id(22);
  watch.mutable_watch_request()->mutable_area()->mutable_disc()->set_radius_um(1);
  peer->Send(watch);
  EXPECT_TRUE(peer->Receive()->has_watch_event());
  peer->Send(CancelOf(23));
  EXPECT_TRUE(peer->Receive()->has_cancel_reply());
  ExpectHoldsNothing();
}

TEST_F(LargeRequestTest, ABrokenOneClosesItsConnection) {
  Serve();
  Bytes frame = EncodeEnvelopeFrame(PosesOf(4, 10'000)).value();
  frame.back() ^= 1;
  const auto spoiled = Connect();
  spoiled->SendBytes(frame);
  EXPECT_EQ(LastWords(*spoiled), StatusCode::kInvalidData);
  const Bytes noise(1u << 20, 0xff);
  frame = EncodeFrameHeader(noise);
  frame.insert(frame.end(), noise.begin(), noise.end());
  const auto senseless = Connect();
  senseless->SendBytes(frame);
  EXPECT_EQ(LastWords(*senseless), StatusCode::kInvalidData);
  ExpectServes();
  ExpectHoldsNothing();
}

TEST_F(LargeRequestTest, WhoLeavesMeanwhileLeavesNothingBehind) {
  Serve();
  for (int i = 0; i < 5; ++i) {
    Connect()->Send(PosesOf(4, 20'000));
  }
  const auto peer = Connect();
  peer->Send(PosesOf(4, 20'000));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidData) << "it comes after the others";
  server_->Stop();
  EXPECT_TRUE(HasDrained());
  ExpectHoldsNothing();
}

TEST_F(LargeRequestTest, IsAnsweredWhenTheDaemonStops) {
  Serve();
  const auto peer = Connect();
  peer->Send(PosesOf(4, 100'000));
  while (server_->ReadFigures().received_bytes < 100'000u) {
  }
  server_->Stop();
  EXPECT_TRUE(HasDrained());
}

}  // namespace
}  // namespace atlas
