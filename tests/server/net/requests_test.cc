// Every request over a real socket.
#include <map>
#include <set>

#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using RequestTest = NetTest;

struct RegionReply {
  std::vector<wire::Envelope> tiles;
  std::uint64_t bytes = 0;  // of all frames
  wire::QueryEnd end;
};

RegionReply ReceiveRegion(BlockingPeer& peer, std::uint64_t request_id) {
  RegionReply region;
  while (true) {
    std::size_t size_bytes = 0;
    std::optional<wire::Envelope> reply = peer.Receive(&size_bytes);
    if (!reply || reply->request_id() != request_id) {
      ADD_FAILURE() << "no end of the reply";
      return region;
    }
    region.bytes += size_bytes;
    if (!reply->has_tile()) {
      EXPECT_TRUE(reply->has_query_end()) << reply->ShortDebugString();
      region.end = reply->query_end();
      return region;
    }
    region.tiles.push_back(std::move(*reply));
  }
}

TEST_F(RequestTest, HelloTellsTheAtlas) {
  Serve();
  BlockingPeer peer(port_);
  const wire::Envelope reply = peer.Greet(kProtocolMajor, ProfileToWire(TestProfile()));
  ASSERT_EQ(reply.body_case(), wire::Envelope::kHelloReply);
  EXPECT_EQ(reply.request_id(), 1u);
  EXPECT_EQ(ProfileFromWire(reply.hello_reply().profile()).value(), TestProfile());
  EXPECT_EQ(reply.hello_reply().atlas_id().size(), 16u);
  EXPECT_EQ(reply.hello_reply().epoch(), 1u);
  EXPECT_EQ(reply.hello_reply().max_frame_bytes(), kMaxFrameBytes);
}

TEST_F(RequestTest, PipelinedUploadsAreEachAnsweredOnceAndDurable) {
  net_.max_requests_in_flight = 8;  // fewer than are sent: reading stops and goes on
  Serve();
  const auto peer = Connect();
  std::set<std::uint64_t> waiting;
  for (std::uint32_t i = 0; i < 60; ++i) {
    ASSERT_TRUE(peer->Send(UploadOf(i % 40, 100 + i)));
    waiting.insert(100 + i);
  }
  int duplicates = 0;
  while (!waiting.empty()) {
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply.has_value());
    ASSERT_EQ(reply->body_case(), wire::Envelope::kUploadReply) << reply->ShortDebugString();
    EXPECT_EQ(waiting.erase(reply->request_id()), 1u);
    duplicates += reply->upload_reply().duplicate() ? 1 : 0;
  }
  EXPECT_EQ(duplicates, 20);
  StopServer();
  Open(0);
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 40u);
}

TEST_F(RequestTest, RequestsSentOneByOneAreAnsweredInTheirOrder) {
  Serve();
  const auto peer = Connect();
  for (std::uint64_t id = 10; id < 30; ++id) {
    peer->Send(id % 2 == 0 ? StatusOf(id) : UploadOf(static_cast<std::uint32_t>(id), id));
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->request_id(), id);
    EXPECT_FALSE(reply->has_error()) << reply->ShortDebugString();
  }
}

TEST_F(RequestTest, AQueryKeepsItsBudgetAndCountsItself) {
  Serve();
  UploadDrive(8);
  Digest();
  const auto peer = Connect();
  peer->Send(QueryOf(9));
  const RegionReply whole = ReceiveRegion(*peer, 9);
  EXPECT_EQ(whole.end.bytes(), whole.bytes);
  EXPECT_FALSE(whole.end.truncated());
  for (const std::uint64_t budget : {64u, 3'000u, 10'000u}) {
    peer->Send(QueryOf(10, budget));
    const RegionReply part = ReceiveRegion(*peer, 10);
    EXPECT_EQ(part.end.bytes(), part.bytes);
    EXPECT_EQ(part.end.tiles(), part.tiles.size());
    EXPECT_LE(part.bytes, budget);
    EXPECT_TRUE(part.end.truncated());
    EXPECT_LT(part.tiles.size(), whole.tiles.size());
  }
}

TEST_F(RequestTest, TilesComeAsTheyAreStored) {
  Serve();
  UploadDrive(2);
  Digest();
  const auto peer = Connect();
  peer->Send(QueryOf(4));
  const RegionReply region = ReceiveRegion(*peer, 4);
  EXPECT_GT(region.tiles.size(), 4u);
  for (const wire::Envelope& reply : region.tiles) {
    const auto id = TileId::FromKey(reply.tile().key()).value();
    const auto stored = store_->ReadTile(id).value();
    ASSERT_TRUE(stored.has_value());
    EXPECT_EQ(reply.tile().blob(), BytesToWire(stored->blob));
    EXPECT_EQ(reply.tile().revision(), stored->revision);
    EXPECT_EQ(reply.tile().payload_hash(), stored->payload_hash);
  }
}

TEST_F(RequestTest, AQueryThatWaitsForARevisionReadsItsOwnWrites) {
  Serve();
  const auto peer = Connect();
  peer->Send(UploadOf(0, 1));
  const auto uploaded = peer->Receive();
  wire::Envelope query = QueryOf(2);
  query.mutable_query_region()->set_wait_revision(uploaded->upload_reply().revision());
  query.mutable_query_region()->set_timeout_ms(60'000);
  peer->Send(query);
  EXPECT_FALSE(ReceiveRegion(*peer, 2).tiles.empty());
  query.mutable_query_region()->set_wait_revision(1'000'000);
  peer->Send(query);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
}

TEST_F(RequestTest, AKeyframeOfAnotherProfileIsRefusedAndTheConnectionGoesOn) {
  Serve();
  const auto peer = Connect();
  MapProfile other = TestProfile();
  other.segment_height_mm = 500;
  UploadRequest foreign = DriveUpload(0);
  foreign.blob = EncodeKeyframe(testing::StreetKeyframe(other, 24, 1));
  peer->Send(UploadOf(std::move(foreign), 3));
  const auto refused = peer->Receive();
  EXPECT_EQ(CodeOf(refused), StatusCode::kInvalidData);
  EXPECT_EQ(refused->request_id(), 3u);
  EXPECT_NE(refused->error().message().find("bus/day/0"), std::string::npos);
  peer->Send(UploadOf(0, 4));
  EXPECT_TRUE(peer->Receive()->has_upload_reply());
}

TEST_F(RequestTest, ErrorsAreTypedAndTheConnectionGoesOn) {
  Serve();
  const auto peer = Connect();
  wire::Envelope move;
  move.set_request_id(5);
  wire::PoseUpdate& update = *move.mutable_update_poses()->add_updates();
  *update.mutable_key() = KeyToWire({{"bus", "day"}, 3});
  *update.mutable_pose() = PoseToWire(QuantizedPose());
  peer->Send(move);
  const auto unknown = peer->Receive();
  EXPECT_EQ(unknown->request_id(), 5u);
  EXPECT_EQ(CodeOf(unknown), StatusCode::kNotFound);
  peer->Send(wire::Envelope());  // no body: a request of a later version
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kUnsupported);
  wire::Envelope not_a_request;
  not_a_request.mutable_tile();
  peer->Send(not_a_request);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kUnsupported);
  peer->Send(StatusOf(6));
  EXPECT_TRUE(peer->Receive()->has_status_reply());
}

TEST_F(RequestTest, ASecondHelloIsToldSo) {
  Serve();
  const auto peer = Connect();
  wire::Envelope hello;
  hello.set_request_id(7);
  hello.mutable_hello()->set_protocol_major(kProtocolMajor);
  peer->Send(hello);
  const auto reply = peer->Receive();
  EXPECT_EQ(CodeOf(reply), StatusCode::kInvalidArgument);
  EXPECT_NE(reply->error().message().find("greeted already"), std::string::npos);
  peer->Send(StatusOf(8));
  EXPECT_TRUE(peer->Receive()->has_status_reply());
}

TEST_F(RequestTest, PipelinedUploadsReachTheDiskInTheirOrder) {
  net_.max_requests_in_flight = 200;
  Serve();
  const auto peer = Connect();
  constexpr std::uint32_t kUploads = 60;
  Bytes all;
  for (std::uint32_t i = 0; i < kUploads; ++i) {
    wire::Envelope upload = UploadOf(i, 100 + i);
    if (i % 10 == 7) {  // refused: nobody waits for it
      upload.mutable_upload_keyframe()->mutable_blob()->resize(5);
    }
    const Bytes frame = EncodeEnvelopeFrame(upload).value();
    all.insert(all.end(), frame.begin(), frame.end());
  }
  peer->SendBytes(all);
  std::map<std::uint64_t, std::uint64_t> revisions;  // by request
  std::uint32_t refused = 0;
  for (std::uint32_t i = 0; i < kUploads; ++i) {
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply.has_value());
    refused += reply->has_error() ? 1u : 0u;
    if (reply->has_upload_reply()) {
      revisions[reply->request_id()] = reply->upload_reply().revision();
    }
  }
  EXPECT_EQ(refused, kUploads / 10);
  std::uint64_t last = 0;
  for (const auto& [request, revision] : revisions) {
    EXPECT_GT(revision, last) << request;
    last = revision;
  }
}

wire::HelloReply Resume(BlockingPeer& peer, const std::string& session) {
  wire::Envelope hello;
  hello.set_request_id(1);
  hello.mutable_hello()->set_protocol_major(kProtocolMajor);
  hello.mutable_hello()->mutable_resume()->set_vehicle("bus");
  hello.mutable_hello()->mutable_resume()->set_session(session);
  peer.Send(hello);
  auto reply = peer.Receive();
  EXPECT_TRUE(reply && reply->has_hello_reply());
  return reply->hello_reply();
}

TEST_F(RequestTest, AHelloThatResumesIsToldTheLastSequence) {
  Serve();
  const auto greet = [this](const std::string& session) {
    BlockingPeer peer(port_);
    return Resume(peer, session);
  };
  EXPECT_FALSE(greet("day").has_last_sequence());
  UploadDrive(5);
  EXPECT_EQ(greet("day").last_sequence(), 4u);
  EXPECT_FALSE(greet("night").has_last_sequence());
}

// Vehicles that never hear a refusal: the store takes one write at a time and refuses the others,
// each connection goes on behind what is there.
TEST_F(RequestTest, BehindTheLastSequenceNothingIsMissing) {
  constexpr std::uint32_t kCount = 150;
  max_queued_writes_ = 1;
  Serve(0);
  std::uint32_t next = 0;
  int connections = 0;
  for (; next < kCount; ++connections) {
    ASSERT_LT(connections, 1'000);
    BlockingPeer peer(port_);
    const wire::HelloReply hello = Resume(peer, "day");
    next = hello.has_last_sequence() ? hello.last_sequence() + 1 : 0;
    ASSERT_EQ(service_->ReadStatus()->counts.keyframes, next);
    for (std::uint32_t i = next; i < kCount; ++i) {
      ASSERT_TRUE(peer.Send(UploadOf(i, 2 + i)));
    }
    for (std::uint32_t i = next; i < kCount; ++i) {
      ASSERT_TRUE(peer.Receive().has_value());
    }
  }
  EXPECT_GT(connections, 2);  // or nothing was ever refused
}

TEST_F(RequestTest, AWaitThatRunsOutSaysSo) {
  Serve(0);  // nothing is ever fused
  UploadDrive(1);
  const auto peer = Connect();
  for (const std::uint32_t timeout_ms : {0u, 1u}) {
    peer->Send(WaitOf(1, timeout_ms));
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply->has_wait_reply()) << reply->ShortDebugString();
    EXPECT_TRUE(reply->wait_reply().timed_out());
    EXPECT_GT(reply->wait_reply().dirty_tiles(), 0u);
    wire::Envelope digest;
    digest.mutable_digest_request()->set_timeout_ms(timeout_ms);
    peer->Send(digest);
    const auto error = peer->Receive();
    EXPECT_EQ(CodeOf(error), StatusCode::kTimeout);
    EXPECT_TRUE(error->error().retry());
  }
}

TEST_F(RequestTest, WaitDigestVerifySessions) {
  Serve();
  UploadDrive(3);
  const auto peer = Connect();
  peer->Send(WaitOf(1, 60'000));
  const auto wait = peer->Receive();
  ASSERT_TRUE(wait->has_wait_reply()) << wait->ShortDebugString();
  EXPECT_EQ(wait->wait_reply().dirty_tiles(), 0u);
  wire::Envelope request;
  request.mutable_digest_request()->set_timeout_ms(60'000);
  peer->Send(request);
  EXPECT_EQ(peer->Receive()->digest_reply().sha256(), BytesToWire(Digest().sha256));
  request.mutable_verify_request()->set_rebuild(true);
  request.mutable_verify_request()->set_timeout_ms(60'000);
  peer->Send(request);
  const auto verified = peer->Receive();
  EXPECT_EQ(verified->verify_reply().mismatched(), 0u);
  EXPECT_GT(verified->verify_reply().checked(), 3u);
  request.mutable_sessions_request();
  peer->Send(request);
  const auto sessions = peer->Receive();
  ASSERT_EQ(sessions->sessions_reply().sessions_size(), 1);
  EXPECT_EQ(sessions->sessions_reply().sessions(0).state(), "live");
  EXPECT_EQ(sessions->sessions_reply().sessions(0).keyframes(), 3u);
}

}  // namespace
}  // namespace atlas
