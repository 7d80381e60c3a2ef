// How often a daemon that refuses for a while is sent keyframes, and how many.
#include <mutex>

#include <gtest/gtest.h>

#include "tests/client/vehicle/spool_peer.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kKeyframes = 10;

// Refuses every upload, until it is told to take them.
class RefusingPeer {
 public:
  explicit RefusingPeer(Status refusal)
      : refusal_(std::move(refusal)), peer_([this](PeerSocket& socket) { Serve(socket); }) {}

  AtlasClient Connect() const { return *AtlasClient::Connect(peer_.options()); }
  void TakeFrom(std::uint32_t sequence) {
    const std::lock_guard lock(mutex_);
    takes_from_ = sequence;
  }
  // Uploads since this was asked last.
  int asked() {
    const std::lock_guard lock(mutex_);
    return std::exchange(asked_, 0);
  }

 private:
  void Serve(PeerSocket& socket) {
    AnswerHello(socket, {});
    while (const auto request = socket.ReadRequest()) {
      const std::lock_guard lock(mutex_);
      ++asked_;
      wire::Envelope reply;
      if (request->upload_keyframe().key().sequence() < takes_from_) {
        *reply.mutable_error() = ErrorToWire(refusal_);
      } else {
        reply.mutable_upload_reply()->set_revision(1);
      }
      socket.Reply(request->request_id(), std::move(reply));
    }
  }

  const Status refusal_;
  std::mutex mutex_;
  std::uint32_t takes_from_ = UINT32_MAX;
  int asked_ = 0;
  TestPeer peer_;
};

class SpoolRefusalsTest : public testing::Test {
 protected:
  UploadSpool Open(milliseconds denied_delay, double random = 0.0) {
    SpoolOptions options;
    options.folder = folder_.path();
    options.denied_delay = denied_delay;
    options.random = [random] {
      return random;
    };
    UploadSpool spool = *UploadSpool::Open(options);
    for (std::uint32_t i = 0; i < kKeyframes; ++i) {
      EXPECT_TRUE(PutOne(spool, i).ok());
    }
    return spool;
  }
  // The first Send after the wait, if there is one.
  static Result<SpoolReport> SendWhenItMay(UploadSpool& spool, AtlasClient& client) {
    Result<SpoolReport> report = spool.Send(client);
    while (report && report->retry_after.count() > 0) {
      report = spool.Send(client);
    }
    return report;
  }

  const TestFolder folder_;
};

TEST_F(SpoolRefusalsTest, WhoMayNotUploadAtAllAsksAgainInHalfADelayToAWholeOne) {
  for (const double random : {0.0, 0.5, 0.999}) {
    RefusingPeer peer({StatusCode::kPermissionDenied, "a reader may not upload"});
    UploadSpool spool = Open(milliseconds(60'000), random);
    AtlasClient client = peer.Connect();
    EXPECT_EQ(spool.Send(client).error().code(), StatusCode::kPermissionDenied);
    EXPECT_GT(peer.asked(), 0);
    for (int call = 0; call < 20; ++call) {
      const auto report = spool.Send(client);
      ASSERT_TRUE(report) << report.error().message();
      EXPECT_EQ(report->sent, 0U);
      EXPECT_EQ(report->waiting, spool.waiting());
      EXPECT_LE(report->retry_after, milliseconds(30'000 + static_cast<int>(30'000 * random)));
      EXPECT_GT(report->retry_after, milliseconds(25'000 + static_cast<int>(30'000 * random)));
    }
    EXPECT_EQ(peer.asked(), 0);
    EXPECT_EQ(spool.refused(), 0U);
  }
}

TEST_F(SpoolRefusalsTest, AnotherConnectionIsAnotherClient) {
  RefusingPeer peer({StatusCode::kPermissionDenied, "a reader may not upload"});
  UploadSpool spool = Open(milliseconds(60'000));
  AtlasClient client = peer.Connect();
  EXPECT_FALSE(spool.Send(client));
  UploadPeer other;
  const auto report = other.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->acknowledged, kKeyframes);
}

TEST_F(SpoolRefusalsTest, AfterAWaitOneKeyframeGoesAndTheOthersWhenItWasTaken) {
  for (const StatusCode code :
       {StatusCode::kPermissionDenied, StatusCode::kResourceExhausted, StatusCode::kUnavailable}) {
    RefusingPeer peer(Status(code, "not now").WithRetryAfter(5));
    UploadSpool spool = Open(milliseconds(10));
    AtlasClient client = peer.Connect();
    EXPECT_EQ(spool.Send(client).error().code(), code);
    EXPECT_GT(peer.asked(), 1) << "nothing was known yet";
    for (int round = 0; round < 3; ++round) {
      EXPECT_EQ(SendWhenItMay(spool, client).error().code(), code);
      EXPECT_EQ(peer.asked(), 1);
    }
    peer.TakeFrom(0);
    const auto report = SendWhenItMay(spool, client);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->acknowledged, kKeyframes);
    EXPECT_EQ(peer.asked(), static_cast<int>(kKeyframes));
  }
}

// A connection that is made again tells the daemon no more than the one before.
TEST_F(SpoolRefusalsTest, SoItIsOnAnotherConnection) {
  UploadSpool spool = Open(milliseconds(10));
  for (int connection = 0; connection < 3; ++connection) {
    RefusingPeer peer({StatusCode::kResourceExhausted, "a full disk"});
    AtlasClient client = peer.Connect();
    EXPECT_FALSE(spool.Send(client));
    EXPECT_EQ(peer.asked() == 1, connection > 0);
  }
}

// What the daemon took of a round that it refused the first of says nothing of the next.
TEST_F(SpoolRefusalsTest, WhatIsTakenBehindARefusalEndsNoDoubt) {
  RefusingPeer peer({StatusCode::kUnavailable, "this session may not begin yet"});
  peer.TakeFrom(5);
  UploadSpool spool = Open(milliseconds(10));
  AtlasClient client = peer.Connect();
  EXPECT_FALSE(spool.Send(client));
  EXPECT_EQ(peer.asked(), static_cast<int>(kKeyframes));
  EXPECT_EQ(spool.waiting(), 5U);
  EXPECT_FALSE(SendWhenItMay(spool, client));
  EXPECT_EQ(peer.asked(), 1);
}

}  // namespace
}  // namespace atlas
