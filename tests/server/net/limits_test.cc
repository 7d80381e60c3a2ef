// Peers that stall, flood or come in crowds: each within its limits, the others served.
#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <sstream>
#include <string>

#include <arpa/inet.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "tests/core/support/no_descriptors.h"
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

class LimitTest : public NetTest {
 protected:
  static constexpr milliseconds kSoon{1'000};
};

// As many as are read in a turn, 60 ms of work together.
TEST_F(LimitTest, RequestsAnsweredAtOnceLeaveOthersOfTheirThreadTheirTurn) {
  net_.threads = 1;
  net_.tile_frame_bytes = 0;
  Serve();
  wire::Envelope sync;
  sync.set_request_id(1);
  auto& disc = *sync.mutable_sync_request()->mutable_area()->mutable_disc();
  disc.mutable_center()->set_x_um(100'000'000'000);  // where nothing is
  disc.set_radius_um(170'000'000);
  const auto peer = Connect();
  const auto other = Connect();
  const auto replies_end = [&] {
    for (auto reply = peer->Receive(); reply && !reply->has_sync_end();) {
      EXPECT_FALSE(reply->has_error());
      reply = peer->Receive();
    }
  };
  peer->Send(sync);  // from the disk, and in memory then
  replies_end();
  constexpr int kRequests = 4'000;
  const Bytes frame = EncodeEnvelopeFrame(sync).value();
  Bytes frames;
  for (int i = 0; i < kRequests; ++i) {
    frames.insert(frames.end(), frame.begin(), frame.end());
  }
  ASSERT_LT(frames.size(), 256u << 10);
  const auto begin = std::chrono::steady_clock::now();
  auto all = std::async(std::launch::async, [&] {
    peer->SendBytes(frames);
    for (int i = 0; i < kRequests; ++i) {
      replies_end();
    }
    return std::chrono::steady_clock::now() - begin;
  });
  std::chrono::steady_clock::duration longest{};
  wire::Envelope cancel;
  cancel.set_request_id(5);
  cancel.mutable_cancel_request()->set_request_id(99);
  while (all.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    const auto asked = std::chrono::steady_clock::now();
    other->Send(cancel);
    EXPECT_TRUE(other->Receive().has_value());
    longest = std::max(longest, std::chrono::steady_clock::now() - asked);
  }
  EXPECT_LT(longest, all.get() / 3);
}

// Looked at again every 50 ms, said once a second.
TEST_F(LimitTest, WithoutDescriptorsTheLogHasFewLinesAndWhoWaitsIsServedLater) {
  const auto before = spdlog::default_logger();
  std::ostringstream log;
  const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(log);
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("atlasd", sink));
  Serve();
  ExpectServes();
  const auto begin = std::chrono::steady_clock::now();
  const int waiting = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  {
    const NoDescriptors none;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port_);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(waiting, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    std::this_thread::sleep_for(milliseconds(600));
  }
  ExpectServes();
  const auto time = std::chrono::steady_clock::now() - begin;
  ::close(waiting);
  StopServer();
  spdlog::set_default_logger(before);
  const std::string line = "accept: Too many open files";
  int lines = 0;
  for (std::size_t at = log.str().find(line); at != std::string::npos;
       at = log.str().find(line, at + 1)) {
    ++lines;
  }
  EXPECT_GE(lines, 1) << log.str();
  EXPECT_LE(lines, 1 + time / std::chrono::seconds(1)) << log.str();
}

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
  net_.idle = milliseconds(50);
  Serve(0);  // nothing is ever fused
  UploadDrive(1);
  wire::Envelope hello;
  hello.mutable_hello()->set_protocol_major(kProtocolMajor);
  Bytes bytes = EncodeEnvelopeFrame(hello).value();
  const Bytes wait = EncodeEnvelopeFrame(WaitOf(3, 500)).value();
  bytes.insert(bytes.end(), wait.begin(), wait.end());
  BlockingPeer peer(port_);
  peer.SendBytes(bytes);
  EXPECT_TRUE(peer.Receive()->has_hello_reply());
  EXPECT_TRUE(peer.Receive()->has_wait_reply());
  EXPECT_TRUE(peer.IsClosed());
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

TEST_F(LimitTest, AStallBehindAWholeFrameEnds) {
  net_.frame = kSoon;
  Serve();
  const auto peer = Connect();
  Bytes bytes = EncodeEnvelopeFrame(StatusOf(5)).value();
  bytes.push_back('R');
  peer->SendBytes(bytes);
  EXPECT_TRUE(peer->Receive()->has_status_reply());
  EXPECT_TRUE(peer->IsClosed());
}

TEST_F(LimitTest, FramesThatWaitForRoomAreNoStall) {
  net_.frame = milliseconds(50);
  net_.max_requests_in_flight = 1;
  Serve(0);  // nothing is ever fused
  UploadDrive(1);
  const auto peer = Connect();
  Bytes bytes = EncodeEnvelopeFrame(WaitOf(1, 300)).value();
  const Bytes next = EncodeEnvelopeFrame(StatusOf(2)).value();
  bytes.insert(bytes.end(), next.begin(), next.end());
  peer->SendBytes(bytes);
  EXPECT_TRUE(peer->Receive()->wait_reply().timed_out());
  EXPECT_TRUE(peer->Receive()->has_status_reply());
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
  const std::uint64_t sent = taken * kQueries / queries.size();
  std::uint64_t ended = 0;
  while (const auto reply = peer->Receive()) {
    ended += reply->has_query_end() ? 1u : 0u;
  }
  EXPECT_GE(ended + 1, sent);
  EXPECT_LT(ended, kQueries);
}

// What waits in the system is heard of again when a third of it left: with megabytes of it a slow
// link looks like one that is gone.
TEST_F(LimitTest, TheSystemKeepsLittleForAReaderThatStops) {
  Serve();
  UploadDrive(12);
  Digest();
  const auto peer = Connect(4'096);
  const std::uint64_t before = server_->ReadFigures().sent_bytes;
  const Bytes queries = PaddedQueries(3'000);
  EXPECT_LT(peer->SendUntilStuck(queries, milliseconds(1'000)), queries.size());
  EXPECT_LT(server_->ReadFigures().sent_bytes - before, 512u << 10);
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

TEST_F(LimitTest, ConnectionsBeyondTheLimitAreToldSo) {
  net_.max_connections = 2;
  Serve();
  const auto first = Connect();
  const auto second = Connect();
  BlockingPeer third(port_);
  const auto reply = third.Receive();
  EXPECT_EQ(CodeOf(reply), StatusCode::kUnavailable);
  EXPECT_TRUE(reply->error().retry());
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

TEST_F(LimitTest, APlaceIsFreeWhenASlowReaderGotItsLastReply) {
  net_.max_connections = 1;
  Serve();
  UploadDrive(12);
  Digest();
  const auto peer = Connect(4'096);
  peer->SendUntilStuck(PaddedQueries(3'000), milliseconds(500));
  peer->CloseSending();
  while (peer->Receive()) {
  }
  ExpectServes();
}

TEST_F(LimitTest, ALargeHelloIsRefused) {
  Serve();
  BlockingPeer peer(port_);
  const wire::Envelope reply = peer.Greet(kProtocolMajor, std::string(20'000, 'p'));
  EXPECT_EQ(CodeOf(reply), StatusCode::kInvalidData);
  EXPECT_FALSE(reply.error().retry());
  EXPECT_TRUE(peer.IsClosed());
}

TEST_F(LimitTest, MoreThanTheDaemonHoldsIsRefused) {
  net_.max_held_bytes = 256u << 10;
  Serve();
  const auto peer = Connect();
  Bytes bytes = EncodeFrameHeader({});
  bytes[6] = 0x10;  // 1 MiB
  bytes.resize(512u << 10);
  peer->SendBytes(bytes);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kResourceExhausted);
  EXPECT_TRUE(peer->IsClosed());
  ExpectServes();
}

TEST_F(LimitTest, WhoeverStallsMakesRoomForWhoeverComes) {
  net_.max_held_bytes = 1u << 20;  // half of it for parts of large requests
  Serve();
  Bytes part = EncodeFrameHeader({});
  part[6] = 0x08;  // 512 KiB, of which a fifth comes
  part.resize(105'000);
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    peers.push_back(Connect());
    peers.back()->SendBytes(part);
    ExpectParts(i * part.size());
  }
  peers.push_back(Connect());
  peers.back()->SendBytes(part);
  const auto closed = peers.front()->Receive();
  EXPECT_EQ(CodeOf(closed), StatusCode::kResourceExhausted);
  EXPECT_TRUE(closed->error().retry());
  EXPECT_TRUE(peers.front()->IsClosed());
  EXPECT_EQ(server_->ReadFigures().parts_closed, 1u);
  ExpectServes();
}

TEST_F(LimitTest, WhatIsAnsweredIsNoLongerHeld) {
  net_.max_held_bytes = 256u << 10;
  Serve();
  const auto peer = Connect();
  std::size_t bytes = 0;
  for (std::uint32_t i = 0; bytes < 4 * net_.max_held_bytes; ++i) {
    const wire::Envelope upload = UploadOf(i % 8, 10 + i);
    bytes += upload.ByteSizeLong();
    ASSERT_TRUE(peer->Send(upload));
    ASSERT_TRUE(peer->Receive()->has_upload_reply());
  }
}

TEST_F(LimitTest, TooManyWaitsAreBusyAndLeaveRoomForWork) {
  net_.max_waits = 2;
  Serve(0);  // nothing is ever fused
  UploadDrive(1);
  const auto peer = Connect();
  for (std::uint64_t id = 1; id <= 3; ++id) {
    peer->Send(WaitOf(id, 60'000));
  }
  const auto busy = peer->Receive();
  EXPECT_EQ(CodeOf(busy), StatusCode::kUnavailable);
  EXPECT_EQ(busy->request_id(), 3u);
  EXPECT_TRUE(busy->error().retry());
  peer->Send(StatusOf(9));
  EXPECT_EQ(peer->Receive()->request_id(), 9u);
}

TEST_F(LimitTest, AWaitEndsWhenItsPeerSendsNoMore) {
  net_.max_waits = 1;
  Serve(0);  // nothing is ever fused
  UploadDrive(1);
  for (int i = 0; i < 5; ++i) {  // one place: each must be given back
    const auto peer = Connect();
    peer->Send(WaitOf(1, 3'600'000));
    peer->CloseSending();
    const auto reply = peer->Receive();
    EXPECT_EQ(CodeOf(reply), StatusCode::kUnavailable);
    EXPECT_NE(reply->error().message().find("gone"), std::string::npos) << reply->error().message();
    EXPECT_TRUE(peer->IsClosed());
  }
}

}  // namespace
}  // namespace atlas
