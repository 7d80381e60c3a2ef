// Stopping: what is in flight is answered, nothing new is taken, and it ends.
#include <csignal>

#include <unistd.h>

#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

class ShutdownTest : public NetTest {
 protected:
  ShutdownTest() { net_.drain = std::chrono::minutes(2); }  // longer than any test waits

  // Reads to the end; how many replies of this kind came.
  static int CountToTheEnd(BlockingPeer& peer, wire::Envelope::BodyCase kind) {
    int count = 0;
    while (const auto reply = peer.Receive()) {
      count += reply->body_case() == kind ? 1 : 0;
    }
    return count;
  }
};

TEST_F(ShutdownTest, RepliesToASlowReaderAreFinishedAndNothingNewIsTaken) {
  net_.max_queued_bytes = 1'024;
  net_.max_requests_in_flight = 4;
  Serve();
  UploadDrive(12);
  Digest();
  auto peer = Connect(4'096);
  peer->SendUntilStuck(PaddedQueries(3'000), std::chrono::milliseconds(500));
  server_->Stop();
  std::set<std::uint64_t> begun;
  std::set<std::uint64_t> ended;
  while (const auto reply = peer->Receive()) {
    (reply->has_query_end() ? ended : begun).insert(reply->request_id());
  }
  EXPECT_GT(begun.size(), 1u);
  EXPECT_EQ(begun, ended);
  peer.reset();
  EXPECT_TRUE(HasDrained());
  EXPECT_FALSE(BlockingPeer(port_).is_connected());
}

TEST_F(ShutdownTest, UploadsThatWereReadAreAcknowledgedAndDurable) {
  Serve();
  auto peer = Connect();
  for (std::uint32_t i = 0; i < 20; ++i) {
    ASSERT_TRUE(peer->Send(UploadOf(i, 100 + i)));
  }
  ASSERT_TRUE(peer->Receive()->has_upload_reply());
  server_->Stop();
  const int acknowledged = 1 + CountToTheEnd(*peer, wire::Envelope::kUploadReply);
  peer.reset();  // until then the daemon would wait for it
  StopServer();
  Open(0);
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, static_cast<std::uint64_t>(acknowledged));
}

TEST_F(ShutdownTest, WaitsEndWithTheDaemon) {
  Serve(0);  // nothing is ever fused
  UploadDrive(1);
  const auto peer = Connect();
  peer->Send(WaitOf(1, 3'600'000));
  wire::Envelope digest;
  digest.set_request_id(2);
  digest.mutable_digest_request()->set_timeout_ms(3'600'000);
  peer->Send(digest);
  peer->Send(UploadOf(1, 3));
  ASSERT_TRUE(peer->Receive()->has_upload_reply());  // all were read by now
  server_->Stop();
  for (int i = 0; i < 2; ++i) {
    const auto reply = peer->Receive();
    EXPECT_EQ(CodeOf(reply), StatusCode::kUnavailable);
    EXPECT_NE(reply->error().message().find("shutting down"), std::string::npos);
  }
  EXPECT_TRUE(peer->IsClosed());
  EXPECT_TRUE(HasDrained());
}

TEST_F(ShutdownTest, AReaderThatDoesNotReadIsCutAfterTheDrainTime) {
  net_.drain = std::chrono::milliseconds(200);
  Serve();
  UploadDrive(12);
  Digest();
  const auto peer = Connect(4'096);
  peer->SendUntilStuck(PaddedQueries(3'000), std::chrono::milliseconds(500));
  server_->Stop();
  EXPECT_TRUE(HasDrained());
  server_.reset();
}

TEST_F(ShutdownTest, SigtermDrains) {
  Serve();
  const auto peer = Connect();
  ASSERT_EQ(::kill(::getpid(), SIGTERM), 0);
  EXPECT_TRUE(HasDrained());
  EXPECT_TRUE(peer->IsClosed());
  EXPECT_FALSE(BlockingPeer(port_).is_connected());
}

TEST_F(ShutdownTest, ASignalBetweenListeningAndServingIsNotLost) {
  Listen(1);
  ASSERT_EQ(::kill(::getpid(), SIGTERM), 0);
  Run();
  EXPECT_TRUE(HasDrained());
}

TEST_F(ShutdownTest, StoppingTwiceOrWithoutConnectionsEnds) {
  Serve();
  server_->Stop();
  StopServer();
  Serve();
  ExpectServes();
}

TEST_F(ShutdownTest, ATakenPortAndWhatIsNoAddressAreRefused) {
  Serve();
  EXPECT_EQ(ListenSocket::Open("127.0.0.1", port_).error().code(), StatusCode::kUnavailable);
  EXPECT_EQ(ListenSocket::Open("example", 0).error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
