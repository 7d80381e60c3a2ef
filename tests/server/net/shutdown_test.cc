// Stopping: what is in flight is answered, nothing new is taken, and it ends.
#include <csignal>

#include <unistd.h>

#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

class ShutdownTest : public NetTest {
 protected:
  // Reads to the end; how many replies of this kind came.
  static int CountToTheEnd(BlockingPeer& peer, wire::Envelope::BodyCase kind) {
    int count = 0;
    while (const auto reply = peer.Receive()) {
      count += reply->body_case() == kind ? 1 : 0;
    }
    return count;
  }
};

TEST_F(ShutdownTest, AReplyThatIsUnderWayIsFinishedAndNothingNewIsTaken) {
  net_.max_queued_bytes = 1'024;
  Serve();
  UploadDrive(12);
  Digest();
  const auto peer = Connect(4'096);
  peer->Send(QueryOf(5));
  ASSERT_TRUE(peer->Receive()->has_tile());
  server_->Stop();
  EXPECT_EQ(CountToTheEnd(*peer, wire::Envelope::kQueryEnd), 1);
  JoinServer();
  EXPECT_FALSE(BlockingPeer(port_).is_connected());
}

TEST_F(ShutdownTest, UploadsThatWereReadAreAcknowledgedAndDurable) {
  Serve();
  const auto peer = Connect();
  for (std::uint32_t i = 0; i < 20; ++i) {
    ASSERT_TRUE(peer->Send(UploadOf(i, 100 + i)));
  }
  ASSERT_TRUE(peer->Receive()->has_upload_reply());
  server_->Stop();
  const int acknowledged = 1 + CountToTheEnd(*peer, wire::Envelope::kUploadReply);
  StopServer();
  Open(0);
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, static_cast<std::uint64_t>(acknowledged));
}

TEST_F(ShutdownTest, SigtermDrains) {
  Serve();
  const auto peer = Connect();
  ASSERT_EQ(::kill(::getpid(), SIGTERM), 0);
  JoinServer();
  EXPECT_TRUE(peer->IsClosed());
  EXPECT_FALSE(BlockingPeer(port_).is_connected());
}

TEST_F(ShutdownTest, ARequestThatDoesNotEndIsCutAfterTheDrainTime) {
  net_.drain = std::chrono::milliseconds(200);
  Serve(0);  // nothing is ever fused
  UploadDrive(1);
  const auto peer = Connect();
  peer->Send(WaitOf(1, 3'600'000));
  peer->Send(UploadOf(1, 2));
  ASSERT_TRUE(peer->Receive()->has_upload_reply());  // both were read by now
  server_->Stop();
  JoinServer();
  server_.reset();
  EXPECT_TRUE(peer->IsClosed());
}

TEST_F(ShutdownTest, StoppingBeforeAnyConnectionEnds) {
  Serve();
  StopServer();
  Serve();
  ExpectServes();
}

TEST_F(ShutdownTest, ATakenPortAndWhatIsNoAddressAreRefused) {
  Serve();
  TcpServer other(*service_, net_);
  EXPECT_EQ(other.Listen("127.0.0.1", port_).error().code(), StatusCode::kUnavailable);
  TcpServer nameless(*service_, net_);
  EXPECT_EQ(nameless.Listen("example", 0).error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
