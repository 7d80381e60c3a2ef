// A Send ends when it is told to, whatever the link does, and the next one goes on.
#include <chrono>
#include <condition_variable>
#include <mutex>

#include <gtest/gtest.h>

#include "tests/client/vehicle/spool_peer.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kDeadline{300};

// Takes keyframes, answers only while it is open, and does not even read while it is asleep.
class GatedPeer {
 public:
  GatedPeer() : peer_([this](PeerSocket& socket) { Serve(socket); }) {}
  ~GatedPeer() { Set(true, false); }
  GatedPeer(const GatedPeer&) = delete;
  GatedPeer& operator=(const GatedPeer&) = delete;
  GatedPeer(GatedPeer&&) = delete;
  GatedPeer& operator=(GatedPeer&&) = delete;

  AtlasClient Connect() const {
    ConnectionOptions options = peer_.options();
    options.request_timeout = std::chrono::seconds(30);
    return *AtlasClient::Connect(options);
  }
  void Set(bool is_open, bool is_asleep) {
    const std::lock_guard lock(mutex_);
    is_open_ = is_open;
    is_asleep_ = is_asleep;
    changed_.notify_all();
  }
  // Once, and at once: the next upload.
  void RefuseNext() {
    const std::lock_guard lock(mutex_);
    refuses_ = true;
  }
  std::vector<std::uint32_t> came() {
    const std::lock_guard lock(mutex_);
    return came_;
  }

 private:
  void Serve(PeerSocket& socket) {
    AnswerHello(socket, {});
    while (true) {
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return !is_asleep_; });
      }
      const auto request = socket.ReadRequest();
      if (!request) return;
      std::unique_lock lock(mutex_);
      if (request->has_upload_keyframe()) {
        came_.push_back(request->upload_keyframe().key().sequence());
      }
      const bool is_refused = std::exchange(refuses_, false);
      changed_.wait(lock, [&] { return is_open_ || is_refused; });
      wire::Envelope reply;
      if (is_refused) {
        *reply.mutable_error() =
            ErrorToWire(Status(StatusCode::kUnavailable, "not now").WithRetryAfter(1));
      } else if (request->has_status_request()) {
        reply.mutable_status_reply();
      } else {
        reply.mutable_upload_reply()->set_revision(1);
      }
      socket.Reply(request->request_id(), std::move(reply));
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = true;
  bool is_asleep_ = false;
  bool refuses_ = false;
  std::vector<std::uint32_t> came_;
  TestPeer peer_;
};

class SpoolLimitsTest : public ::testing::Test {
 protected:
  void Put(std::uint32_t count, std::size_t bytes = 100) {
    for (std::uint32_t i = 0; i < count; ++i) {
      ASSERT_TRUE(PutOne(spool_, i, bytes).ok());
    }
  }
  SpoolReport Send(AtlasClient& client, const SendLimits& limits = {.deadline = kDeadline}) {
    const Clock::time_point start = Clock::now();
    const auto report = spool_.Send(client, limits);
    EXPECT_LT(Clock::now() - start, limits.deadline + testing::Slack(700));
    EXPECT_TRUE(report) << report.error().message();
    return report.value_or(SpoolReport());
  }

  const TestFolder folder_;
  UploadSpool spool_ = OpenSpool(folder_);
  GatedPeer peer_;
};

TEST_F(SpoolLimitsTest, WhatIsNotAnsweredInTimeIsAnsweredInTheNextCallAndNotSentAgain) {
  Put(5);
  AtlasClient client = peer_.Connect();
  peer_.Set(false, false);
  const SpoolReport first = Send(client);
  EXPECT_EQ(first.acknowledged, 0U);
  EXPECT_EQ(first.sent, 5U);
  EXPECT_EQ(first.in_flight, 5U);
  EXPECT_EQ(first.waiting, 5U);
  UploadSpool moved = std::move(spool_);
  spool_ = std::move(moved);
  peer_.Set(true, false);
  ASSERT_TRUE(PutOne(spool_, 5).ok());
  const SpoolReport second = Send(client, {});
  EXPECT_EQ(second.acknowledged, 6U);
  EXPECT_EQ(second.sent, 1U);
  EXPECT_EQ(second.in_flight, 0U);
  EXPECT_EQ(second.waiting, 0U);
  EXPECT_EQ(peer_.came(), UpTo(6));
  EXPECT_TRUE(FilesOf(folder_.path()).empty());
}

// More than the system's buffers take: the frame that is on its way goes on in the next call.
TEST_F(SpoolLimitsTest, APeerThatDoesNotReadHoldsNoCallAndNothingIsSentTwice) {
  Put(4, std::size_t{12} << 20);
  peer_.Set(true, true);  // before it can read a request
  AtlasClient client = peer_.Connect();
  const SpoolReport first = Send(client);
  EXPECT_EQ(first.acknowledged, 0U);
  EXPECT_LT(first.sent, 4U);
  EXPECT_EQ(Send(client).sent, 0U);
  peer_.Set(true, false);
  std::uint64_t acknowledged = 0;
  for (int call = 0; call < 50 && spool_.waiting() > 0; ++call) {
    acknowledged += Send(client).acknowledged;
  }
  EXPECT_EQ(acknowledged, 4U);
  EXPECT_EQ(peer_.came(), UpTo(4));
}

TEST_F(SpoolLimitsTest, ABudgetEndsACallAndTheNextGoesOn) {
  Put(10, 1'000);
  AtlasClient client = peer_.Connect();
  const std::uint64_t one = spool_.waiting_bytes() / 10;
  for (std::uint32_t call = 1; call <= 3; ++call) {
    const SpoolReport report = Send(client, {.budget_bytes = 3 * one});
    EXPECT_EQ(report.sent, 3U);
    EXPECT_EQ(report.sent_bytes, 3 * one);
    EXPECT_EQ(report.acknowledged, 3U);
    EXPECT_EQ(report.waiting, 10 - 3 * call);
  }
  EXPECT_EQ(Send(client, {.budget_bytes = 3 * one}).waiting, 0U);
  EXPECT_EQ(peer_.came(), UpTo(10));
}

TEST_F(SpoolLimitsTest, ACallWithoutTimeSendsNothing) {
  Put(3);
  AtlasClient client = peer_.Connect();
  const SpoolReport report = Send(client, {.deadline = milliseconds(0)});
  EXPECT_EQ(report.sent, 0U);
  EXPECT_EQ(report.waiting, 3U);
  EXPECT_EQ(Send(client).acknowledged, 3U);
}

TEST_F(SpoolLimitsTest, OnAnotherConnectionWhatWasNotAnsweredIsSentAgain) {
  Put(3);
  {
    AtlasClient client = peer_.Connect();
    peer_.Set(false, false);
    EXPECT_EQ(Send(client).in_flight, 3U);
  }
  UploadPeer other;
  const auto report = other.Take(spool_);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->acknowledged, 3U);
  EXPECT_EQ(other.came(), UpTo(3));
}

// The answers to what was on its way come first, then what was refused is sent again.
TEST_F(SpoolLimitsTest, ARoundThatARefusalEndedEndsInTheNextCallWhichBeginsAnother) {
  Put(3);
  AtlasClient client = peer_.Connect();
  peer_.RefuseNext();
  peer_.Set(false, false);
  const auto refused = spool_.Send(client, {.deadline = kDeadline});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code(), StatusCode::kUnavailable);
  peer_.Set(true, false);
  const SpoolReport report = Send(client, {});
  EXPECT_EQ(report.acknowledged, 3U);
  EXPECT_EQ(report.waiting, 0U);
  EXPECT_EQ(peer_.came().size(), 4U) << "each once, the first one twice";
}

TEST_F(SpoolLimitsTest, AnotherRequestMeanwhileLosesNoAnswer) {
  Put(3);
  AtlasClient client = peer_.Connect();
  peer_.Set(false, false);
  EXPECT_EQ(Send(client).in_flight, 3U);
  peer_.Set(true, false);
  ASSERT_TRUE(client.ReadStatus());
  const SpoolReport report = Send(client);
  EXPECT_EQ(report.acknowledged, 3U);
  EXPECT_EQ(report.sent, 0U);
  EXPECT_EQ(peer_.came(), UpTo(3));
}

}  // namespace
}  // namespace atlas
