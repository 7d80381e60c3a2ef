// Keyframes that matter nowhere any more, dropped over a real socket.
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

constexpr std::int64_t kPass_ms = 1'000'000;

class CompactionRequestTest : public NetTest {
 protected:
  CompactionRequestTest() { profile_.preset = FusionPreset::kBounded; }

  static wire::Envelope CompactBefore(std::int64_t before_ms, std::uint32_t timeout_ms = 60'000) {
    wire::Envelope envelope;
    envelope.set_request_id(5);
    wire::CompactRequest& compact = *envelope.mutable_compact_request();
    compact.set_before_ms(before_ms);
    compact.set_author("tester");
    compact.set_timeout_ms(timeout_ms);
    return envelope;
  }
  // The same two keyframes each time.
  void UploadPasses(std::uint32_t count) {
    for (std::uint32_t pass = 0; pass < count; ++pass) {
      for (std::uint32_t i = 0; i < 2; ++i) {
        UploadRequest request = DriveUpload(i, "pass" + std::to_string(pass), profile_);
        request.time_ms += pass * kPass_ms;
        ASSERT_TRUE(Upload(request).has_value());
      }
    }
  }
};

TEST_F(CompactionRequestTest, OldPassesGoAndAreCounted) {
  Serve();
  UploadPasses(5);
  const AtlasDigest before = Digest();
  const auto peer = Connect();
  peer->Send(CompactBefore(kTestNow_ms));
  const auto reply = peer->Receive();
  ASSERT_TRUE(reply->has_compact_reply()) << reply->ShortDebugString();
  EXPECT_EQ(reply->request_id(), 5u);
  const wire::CompactReply& done = reply->compact_reply();
  EXPECT_EQ(done.dropped(), 4u);
  EXPECT_GT(done.bytes(), 0u);
  EXPECT_GT(done.tiles_checked(), 0u);
  EXPECT_EQ(done.revision(), before.revision + 1);
  EXPECT_EQ(done.horizon(), done.revision());
  EXPECT_EQ(Digest().sha256, before.sha256);
  peer->Send(StatusOf(6));
  EXPECT_EQ(peer->Receive()->status_reply().compacted(), 4u);
  wire::Envelope sessions;
  sessions.mutable_sessions_request();
  peer->Send(sessions);
  const auto listed = peer->Receive();
  EXPECT_EQ(listed->sessions_reply().sessions(0).compacted(), 2u);
  EXPECT_EQ(listed->sessions_reply().sessions(0).keyframes(), 0u);
  EXPECT_EQ(listed->sessions_reply().sessions(0).state(), "live");
  EXPECT_EQ(listed->sessions_reply().sessions(4).compacted(), 0u);
  wire::Envelope past;
  past.mutable_digest_request()->set_at_revision(before.revision);
  past.mutable_digest_request()->set_timeout_ms(60'000);
  peer->Send(past);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kNotFound);
}

TEST_F(CompactionRequestTest, BadRequestsAreTyped) {
  Serve();
  UploadPasses(4);
  Digest();
  const auto peer = Connect();
  peer->Send(CompactBefore(-1));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
  wire::Envelope nameless = CompactBefore(1);
  nameless.mutable_compact_request()->set_author("a b");
  peer->Send(nameless);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
  peer->Send(CompactBefore(kTestNow_ms, 0));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kTimeout);
  EXPECT_EQ(service_->ReadStatus()->counts.compacted, 0u);
  ExpectServes();
}

TEST_F(CompactionRequestTest, OtherPresetsAreRefusedAtOnce) {
  profile_.preset = FusionPreset::kStrict;
  Serve(0);  // nothing is ever fused: it does not wait
  ASSERT_TRUE(Upload(DriveUpload(0)).has_value());
  const auto peer = Connect();
  peer->Send(CompactBefore(kTestNow_ms));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
}

TEST_F(CompactionRequestTest, ItTakesAPlace) {
  net_.max_works = 0;
  Serve();
  const auto peer = Connect();
  peer->Send(CompactBefore(1));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kUnavailable);
}

}  // namespace
}  // namespace atlas
