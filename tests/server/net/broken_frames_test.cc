// Peers that send what is no frame, no Hello or no request: typed errors for them, service for the
// others.
#include <future>
#include <string_view>

#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

class BrokenFrameTest : public NetTest {
 protected:
  void SetUp() override { Serve(); }
  void TearDown() override { ExpectServes(); }

  // The error that the daemon sends before it closes.
  static StatusCode LastWords(BlockingPeer& peer) {
    const auto reply = peer.Receive();
    if (!reply) {
      return StatusCode::kOk;  // closed without a word
    }
    EXPECT_EQ(reply->request_id(), 0u);
    EXPECT_TRUE(reply->has_error()) << reply->ShortDebugString();
    EXPECT_TRUE(peer.IsClosed());
    return CodeOf(reply);
  }
  static Bytes HeaderClaiming(std::uint32_t payload_bytes) {
    Bytes header = EncodeFrameHeader({});
    for (std::size_t i = 0; i < 4; ++i) {
      header[4 + i] = static_cast<std::uint8_t>(payload_bytes >> (8 * i));
    }
    return header;
  }
};

TEST_F(BrokenFrameTest, AnotherProtocol) {
  const std::string_view text = "GET / HTTP/1.1\r\nHost: atlas\r\n\r\n";
  BlockingPeer peer(port_);
  peer.SendBytes(Bytes(text.begin(), text.end()));
  EXPECT_EQ(LastWords(peer), StatusCode::kInvalidData);
}

TEST_F(BrokenFrameTest, GarbageAfterTheHandshake) {
  const auto peer = Connect();
  peer->SendBytes(Bytes(10'000, 0xAB));
  EXPECT_EQ(LastWords(*peer), StatusCode::kInvalidData);
}

TEST_F(BrokenFrameTest, ARefusedPeerReadsWhyAlthoughItStillSends) {
  const auto peer = Connect();
  peer->SendBytes(Bytes(4'000'000, 0xAB));
  EXPECT_EQ(LastWords(*peer), StatusCode::kInvalidData);
}

TEST_F(BrokenFrameTest, AWrongMagicBehindAGoodFrame) {
  const auto peer = Connect();
  Bytes bytes = EncodeEnvelopeFrame(StatusOf(5)).value();
  const Bytes bad = {'R', 'A', 'F', '2'};
  bytes.insert(bytes.end(), bad.begin(), bad.end());
  peer->SendBytes(bytes);
  StatusCode error = StatusCode::kOk;
  bool is_answered = false;
  while (const auto reply = peer->Receive()) {
    is_answered |= reply->has_status_reply();
    error = reply->has_error() ? CodeOf(reply) : error;
  }
  EXPECT_TRUE(is_answered);
  EXPECT_EQ(error, StatusCode::kInvalidData);
}

TEST_F(BrokenFrameTest, AFrameThatClaimsTooMuch) {
  for (const std::uint32_t claim : {kMaxFrameBytes + 1, 0x7FFF'FFFFu, 0xFFFF'FFFFu}) {
    const auto peer = Connect();
    peer->SendBytes(HeaderClaiming(claim));
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply.has_value()) << claim;
    EXPECT_EQ(reply->request_id(), 0u);
    EXPECT_EQ(CodeOf(reply), StatusCode::kInvalidData) << claim;
    EXPECT_FALSE(reply->error().retry());
    EXPECT_EQ(reply->error().retry_after_ms(), 0u);
    EXPECT_TRUE(peer->IsClosed());
  }
}

TEST_F(BrokenFrameTest, AWrongChecksum) {
  const auto peer = Connect();
  Bytes frame = EncodeEnvelopeFrame(StatusOf(1)).value();
  frame.back() ^= 1;
  peer->SendBytes(frame);
  EXPECT_EQ(LastWords(*peer), StatusCode::kInvalidData);
}

TEST_F(BrokenFrameTest, APayloadThatIsNoEnvelope) {
  const auto peer = Connect();
  const Bytes payload(20, 0xFF);
  Bytes frame = EncodeFrameHeader(payload);
  frame.insert(frame.end(), payload.begin(), payload.end());
  peer->SendBytes(frame);
  EXPECT_EQ(LastWords(*peer), StatusCode::kInvalidData);
}

TEST_F(BrokenFrameTest, LeavingInTheMiddleOfAFrame) {
  const Bytes frame = EncodeEnvelopeFrame(UploadOf(0, 1)).value();
  for (const std::size_t part : {1u, 11u, 12u, 13u, 500u}) {
    const auto peer = Connect();
    peer->SendBytes(ByteSpan(frame).first(part));
    peer->CloseSending();
    EXPECT_TRUE(peer->IsClosed());
  }
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 0u);
}

TEST_F(BrokenFrameTest, AnotherMajorVersion) {
  for (const std::uint32_t major : {0u, kProtocolMajor + 1}) {
    BlockingPeer peer(port_);
    const wire::Envelope reply = peer.Greet(major);
    EXPECT_EQ(CodeOf(reply), StatusCode::kUnsupported);
    EXPECT_FALSE(reply.error().retry());
    EXPECT_TRUE(peer.IsClosed());
  }
}

TEST_F(BrokenFrameTest, AHelloWithAnotherProfile) {
  const std::string own = ProfileToWire(TestProfile());
  for (const std::string& profile : {ProfileToWire(MapProfile()), own.substr(0, own.size() / 2)}) {
    BlockingPeer peer(port_);
    EXPECT_EQ(CodeOf(peer.Greet(kProtocolMajor, profile)), StatusCode::kInvalidData);
    EXPECT_TRUE(peer.IsClosed());
  }
}

TEST_F(BrokenFrameTest, ARequestBeforeTheHello) {
  BlockingPeer peer(port_);
  peer.Send(UploadOf(0, 1));
  EXPECT_EQ(CodeOf(peer.Receive()), StatusCode::kInvalidData);
  EXPECT_TRUE(peer.IsClosed());
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 0u);
}

TEST_F(BrokenFrameTest, ManyAtOnce) {
  std::vector<std::future<void>> peers;
  for (std::uint32_t n = 0; n < 24; ++n) {
    peers.push_back(std::async(std::launch::async, [this, n] {
      BlockingPeer peer(port_);
      if (n % 3 == 0) {
        peer.SendBytes(Bytes(1'000 + n, static_cast<std::uint8_t>(n)));
        EXPECT_EQ(LastWords(peer), StatusCode::kInvalidData);
        return;
      }
      EXPECT_TRUE(peer.Greet().has_hello_reply());
      peer.Send(UploadOf(n % 8, n));
      if (n % 3 == 1) {
        EXPECT_EQ(peer.Receive()->request_id(), n);
      }  // else it leaves without its answer
    }));
  }
  for (auto& peer : peers) {
    peer.get();
  }
}

}  // namespace
}  // namespace atlas
