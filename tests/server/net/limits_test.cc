// Peers that stall, flood or come in crowds: each within its limits, the others served.
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

class LimitTest : public NetTest {
 protected:
  static constexpr milliseconds kSoon{200};

  // A query padded with a field that the daemon does not know, so that few of them fill a socket.
  static Bytes PaddedQuery(std::uint64_t request_id) {
    wire::Envelope query = QueryOf(request_id);
    query.GetReflection()->MutableUnknownFields(&query)->AddLengthDelimited(1'000)->assign(2'000,
                                                                                           'x');
    return EncodeEnvelopeFrame(query).value();
  }
  static Bytes PaddedQueries(std::uint64_t count) {
    Bytes bytes;
    for (std::uint64_t id = 1; id <= count; ++id) {
      const Bytes frame = PaddedQuery(id);
      bytes.insert(bytes.end(), frame.begin(), frame.end());
    }
    return bytes;
  }
};

TEST_F(LimitTest, SilenceBeforeTheHelloEnds) {
  net_.handshake = kSoon;
  Serve();
  BlockingPeer peer(port_);
  EXPECT_TRUE(peer.IsClosed());
  ExpectServes();
}

TEST_F(LimitTest, SilenceBetweenFramesEnds) {
  net_.idle = kSoon;
  Serve();
  const auto peer = Connect();
  EXPECT_TRUE(peer->IsClosed());
  ExpectServes();
}

TEST_F(LimitTest, SilenceWhileARequestRunsIsNotIdle) {
  net_.idle = milliseconds(20);
  Serve(0);  // nothing is ever fused
  UploadDrive(1);
  const auto peer = Connect();
  peer->Send(WaitOf(3, 300));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kTimeout);  // the wait's, not the connection's
  EXPECT_TRUE(peer->IsClosed());
}

TEST_F(LimitTest, AStallInTheMiddleOfAFrameEnds) {
  net_.frame = kSoon;
  Serve();
  const auto peer = Connect();
  const Bytes frame = EncodeEnvelopeFrame(UploadOf(0, 1)).value();
  peer->SendBytes(ByteSpan(frame).first(frame.size() / 2));
  EXPECT_TRUE(peer->IsClosed());
  ExpectServes();
  EXPECT_EQ(service_->ReadStatus()->counts.keyframes, 0u);
}

TEST_F(LimitTest, ALargeClaimCostsNothingUntilBytesCome) {
  net_.frame = kSoon;
  Serve();
  const std::uint64_t before = service_->ReadStatus()->rss_bytes;
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  for (int i = 0; i < 20; ++i) {
    Bytes header = EncodeFrameHeader({});
    header[7] = 2;  // 32 MiB, of which nothing comes
    peers.push_back(Connect());
    peers.back()->SendBytes(header);
  }
  ExpectServes();
  EXPECT_LT(service_->ReadStatus()->rss_bytes, before + (64u << 20));
  for (const auto& peer : peers) {
    EXPECT_TRUE(peer->IsClosed());
  }
}

TEST_F(LimitTest, AReaderThatStopsFillsItsOwnQueueAndLosesNothing) {
  constexpr std::uint64_t kQueries = 3'000;
  net_.max_queued_bytes = 4'096;
  net_.max_requests_in_flight = 4;
  Serve();
  UploadDrive(12);
  Digest();
  const auto peer = Connect(4'096);
  // Replies fill every buffer, then the daemon stops reading from this peer: no more is sent.
  const Bytes queries = PaddedQueries(kQueries);
  const std::size_t taken = peer->SendUntilStuck(queries, milliseconds(1'000));
  EXPECT_LT(taken, queries.size());
  ExpectServes();
  // It reads again: everything that was sent whole is answered.
  peer->CloseSending();
  const std::uint64_t sent = taken / PaddedQuery(1'000).size();
  std::uint64_t ended = 0;
  while (const auto reply = peer->Receive()) {
    ended += reply->has_query_end() ? 1u : 0u;
  }
  EXPECT_GE(ended, sent);
  EXPECT_LT(ended, kQueries);
}

TEST_F(LimitTest, AReaderThatNeverReadsAgainIsClosed) {
  net_.write_stall = kSoon;
  Serve();
  UploadDrive(12);
  Digest();
  const auto peer = Connect(4'096);
  const Bytes queries = PaddedQueries(3'000);
  EXPECT_LT(peer->SendUntilStuck(queries, milliseconds(5'000)), queries.size());
  ExpectServes();
}

TEST_F(LimitTest, ConnectionsBeyondTheLimitAreClosed) {
  net_.max_connections = 2;
  Serve();
  const auto first = Connect();
  const auto second = Connect();
  BlockingPeer third(port_);
  EXPECT_TRUE(third.IsClosed());
  first->Send(StatusOf(1));
  EXPECT_TRUE(first->Receive().has_value());
}

TEST_F(LimitTest, APlaceIsFreeWhenItsConnectionLeft) {
  net_.max_connections = 1;
  Serve();
  for (int i = 0; i < 20; ++i) {
    const auto peer = Connect();
    peer->CloseSending();
    EXPECT_TRUE(peer->IsClosed());
  }
}

}  // namespace
}  // namespace atlas
