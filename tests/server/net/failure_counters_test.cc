// What goes wrong with peers is counted, each kind of it by itself.
#include <chrono>
#include <thread>

#include <gtest/gtest.h>
#include <openssl/ssl.h>

#include "tests/server/net/tls_fixture.h"

namespace atlas {
namespace {

class FailureCountersTest : public TlsTest {
 protected:
  // When nobody is connected any more and so many were counted, which is a moment later.
  NetFigures AtTheEnd(std::uint64_t NetFigures::*count, std::uint64_t expected) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    NetFigures figures = server_->ReadFigures();
    while ((figures.connections > 0 || figures.*count < expected) &&
           std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      figures = server_->ReadFigures();
    }
    EXPECT_EQ(figures.connections, 0u);
    EXPECT_EQ(figures.*count, expected);
    return figures;
  }
  static std::uint64_t Late(const NetFigures& figures, RequestKind kind) {
    return figures.kinds[static_cast<std::size_t>(kind)].late;
  }
};

TEST_F(FailureCountersTest, FramesThatBreakTheProtocol) {
  Serve();
  const Bytes good = EncodeEnvelopeFrame(StatusOf(1)).value();
  Bytes damaged = good;
  damaged.back() ^= 1;
  Bytes large = EncodeFrameHeader(Bytes(net_.large_frame_bytes + 1, 0xFF));
  large.resize(large.size() + net_.large_frame_bytes + 1, 0xFF);
  for (const Bytes& broken : {Bytes(100, 0xAB), damaged, large}) {
    const auto peer = Connect();
    peer->SendBytes(broken);
    EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidData);
  }
  AtTheEnd(&NetFigures::broken_frames, 3);
}

TEST_F(FailureCountersTest, WhatIsNoBrokenFrame) {
  Serve();
  {
    const auto peer = Connect();
    peer->Send(wire::Envelope());  // no body: a request of a later version
    EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kUnsupported);
    const Bytes frame = EncodeEnvelopeFrame(StatusOf(1)).value();
    peer->SendBytes(ByteSpan(frame).first(5));  // and goes
  }
  EXPECT_EQ(AtTheEnd(&NetFigures::broken_frames, 0).handshakes_failed, 0u);
}

TEST_F(FailureCountersTest, HandshakesThatFail) {
  net_.handshake = std::chrono::milliseconds(200);
  ServeTls();
  BlockingPeer plain(port_);
  plain.Greet();
  BlockingPeer::Tls old = As("car.7");
  old.max_version = TLS1_2_VERSION;
  EXPECT_FALSE(BlockingPeer(port_, old).is_encrypted());
  const TestAuthority others(directory_, "others");
  BlockingPeer stranger(port_, {ca_->certificate(), others.Issue("car.7")});
  EXPECT_TRUE(stranger.IsClosed());
  BlockingPeer doubtful(port_, BlockingPeer::Tls{others.certificate()});  // of the daemon
  EXPECT_FALSE(doubtful.is_encrypted());
  BlockingPeer half(port_);
  half.SendBytes(Bytes{0x16, 0x03, 0x01, 0x02, 0x00});  // a record's head, and no more
  EXPECT_TRUE(half.IsClosed());
  AtTheEnd(&NetFigures::handshakes_failed, 5);
}

TEST_F(FailureCountersTest, WhatIsNoHandshakeThatFails) {
  ServeTls();
  {
    const BlockingPeer silent(port_);
    BlockingPeer nobody(port_, Anonymous());
    EXPECT_EQ(CodeOf(nobody.Greet()), StatusCode::kPermissionDenied);
    BlockingPeer car(port_, As("car.7"));
    EXPECT_TRUE(car.Greet().has_hello_reply());
    car.SendUntilStuck(Bytes(100, 0xAB), std::chrono::seconds(30));  // past TLS: no record of it
    EXPECT_TRUE(car.IsClosed());
  }
  EXPECT_EQ(AtTheEnd(&NetFigures::handshakes_failed, 0).broken_frames, 0u);
}

TEST_F(FailureCountersTest, RequestsWhoseDeadlinePassed) {
  Serve(0);  // nothing is ever fused
  const auto peer = Connect();
  EXPECT_FALSE(Late(server_->ReadFigures(), RequestKind::kWait));
  peer->Send(WaitOf(1, 1));
  EXPECT_FALSE(peer->Receive()->wait_reply().timed_out());
  peer->Send(UploadOf(0, 2));
  const std::uint64_t revision = peer->Receive()->upload_reply().revision();
  peer->Send(WaitOf(3, 1));
  EXPECT_TRUE(peer->Receive()->wait_reply().timed_out());
  wire::Envelope query = QueryOf(4);
  query.mutable_query_region()->set_wait_revision(revision);
  query.mutable_query_region()->set_timeout_ms(1);
  peer->Send(query);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kTimeout);
  const NetFigures figures = server_->ReadFigures();
  EXPECT_EQ(Late(figures, RequestKind::kWait), 1u);
  EXPECT_EQ(Late(figures, RequestKind::kQueryRegion), 1u);
  EXPECT_EQ(Late(figures, RequestKind::kUploadKeyframe), 0u);
}

}  // namespace
}  // namespace atlas
