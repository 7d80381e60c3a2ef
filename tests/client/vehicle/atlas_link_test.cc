// Attempts, pauses and refusals, with a clock that stands still unless somebody sleeps.
#include "client/vehicle/atlas_link.h"

#include <deque>

#include <gtest/gtest.h>

#include "tests/client/vehicle/sync_peer.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

// Connections that fail as scripted; at the script's end they succeed.
class LinkWorld {
 public:
  std::deque<Status> failures;
  double random = 0.999999;
  milliseconds retry_after{0};  // that failures ask for
  std::vector<milliseconds> pauses;
  std::vector<milliseconds> timeouts;

  LinkEnvironment environment() {
    return {[this] { return now_; },
            [this](milliseconds pause) {
              pauses.push_back(pause);
              now_ += pause;
            },
            [this] { return random; },
            [this](const ConnectionOptions& options, milliseconds& asked) -> Result<AtlasClient> {
              timeouts.push_back(options.connect_timeout);
              if (failures.empty()) return AtlasClient::Connect(peer_.options());
              const Status failure = failures.front();
              failures.pop_front();
              asked = retry_after;
              return Error(failure);
            }};
  }
  void Pass(milliseconds time) { now_ += time; }

 private:
  LinkEnvironment::Clock::time_point now_{};
  TinyWorld map_;
  SyncPeer peer_{map_};
};

const Status kAway(StatusCode::kUnavailable, "nobody there");

TEST(AtlasLinkTest, PausesDoubleUpToTheLongest) {
  LinkWorld world;
  world.failures.assign(6, kAway);
  AtlasLink link(
      {.connection = {}, .first_delay = milliseconds(100), .max_delay = milliseconds(1'000)},
      world.environment());
  const auto client = link.Wait(milliseconds(60'000));
  ASSERT_TRUE(client) << client.error().message();
  ASSERT_EQ(world.pauses.size(), 6U);
  const std::vector<int> most = {100, 200, 400, 800, 1'000, 1'000};
  for (std::size_t i = 0; i < most.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(world.pauses[i].count()), most[i], 1.0);
  }
}

TEST(AtlasLinkTest, JitterIsFull) {
  LinkWorld world;
  world.random = 0.0;
  world.failures.assign(20, kAway);
  AtlasLink link({}, world.environment());
  ASSERT_TRUE(link.Wait(milliseconds(10)));
  EXPECT_TRUE(world.pauses.empty());
}

// The random part comes on top: a fleet that was refused together does not come back together.
TEST(AtlasLinkTest, ABusyDaemonIsLeftAloneForAsLongAsItAsks) {
  LinkWorld world;
  world.retry_after = milliseconds(5'000);
  world.failures.assign(2, {StatusCode::kUnavailable, "busy"});
  AtlasLink link({.connection = {}, .first_delay = milliseconds(100)}, world.environment());
  world.random = 0.0;
  ASSERT_FALSE(link.Client(milliseconds(50)));
  world.Pass(milliseconds(4'999));
  EXPECT_FALSE(link.Client(milliseconds(50)));
  EXPECT_EQ(world.timeouts.size(), 1U);
  world.random = 0.5;
  ASSERT_TRUE(link.Wait(milliseconds(60'000)));
  EXPECT_EQ(world.pauses, (std::vector{milliseconds(1), milliseconds(5'100)}));
}

TEST(AtlasLinkTest, WhatARefusedRequestAskedForHoldsForTheNextConnection) {
  TestPeer busy([](PeerSocket& socket) {
    AnswerHello(socket, {});
    const auto request = socket.ReadRequest();
    wire::Envelope reply;
    reply.mutable_error()->set_code(static_cast<int>(StatusCode::kUnavailable));
    reply.mutable_error()->set_retry(true);
    reply.mutable_error()->set_retry_after_ms(~0U);
    socket.Reply(request->request_id(), std::move(reply));
    socket.Drain();
  });
  LinkWorld world;
  world.random = 0.0;
  LinkEnvironment environment = world.environment();
  environment.connect = [&busy](const ConnectionOptions&, milliseconds& retry_after) {
    return AtlasClient::Connect(busy.options(), retry_after);
  };
  AtlasLink link({}, environment);
  const auto client = link.Client(milliseconds(50));
  ASSERT_TRUE(client) << client.error().message();
  EXPECT_EQ((*client)->retry_after(), milliseconds(0));
  const auto status = (*client)->ReadStatus();
  ASSERT_FALSE(status);
  // Bounded, by the clock of the connection, of which some has passed.
  EXPECT_LE((*client)->retry_after(), milliseconds(60'000));
  EXPECT_GE((*client)->retry_after(), milliseconds(30'000));
  link.Report(status.error());
  world.Pass(milliseconds(29'000));
  EXPECT_FALSE(link.Client(milliseconds(50)));
  EXPECT_FALSE(link.is_connected());
}

TEST(AtlasLinkTest, WithoutWaitingAnAttemptIsMadeOnlyWhenItIsDue) {
  LinkWorld world;
  world.failures = {kAway};
  AtlasLink link({}, world.environment());
  EXPECT_FALSE(link.Client(milliseconds(50)));
  EXPECT_EQ(world.timeouts, (std::vector{milliseconds(50)}));
  const auto early = link.Client(milliseconds(50));
  ASSERT_FALSE(early);
  EXPECT_EQ(early.error().code(), StatusCode::kUnavailable);
  EXPECT_EQ(world.timeouts.size(), 1U);
  world.Pass(milliseconds(500));
  EXPECT_TRUE(link.Client(milliseconds(50)));
  EXPECT_TRUE(world.pauses.empty());
}

TEST(AtlasLinkTest, ADeadlineEndsTheWait) {
  LinkWorld world;
  world.failures.assign(1'000, kAway);
  AtlasLink link({}, world.environment());
  const auto client = link.Wait(milliseconds(5'000));
  ASSERT_FALSE(client);
  EXPECT_EQ(client.error(), kAway);
  milliseconds slept{0};
  for (const milliseconds pause : world.pauses) {
    slept += pause;
  }
  EXPECT_LE(slept, milliseconds(5'000));
}

TEST(AtlasLinkTest, WhatWillFailAgainIsNotTriedAgain) {
  for (const StatusCode code : {StatusCode::kInvalidData, StatusCode::kPermissionDenied,
                                StatusCode::kUnsupported, StatusCode::kInvalidArgument}) {
    LinkWorld world;
    world.failures = {{code, "never"}};
    AtlasLink link({}, world.environment());
    EXPECT_EQ(link.Wait(milliseconds(60'000)).error().code(), code);
    EXPECT_EQ(link.Wait(milliseconds(60'000)).error().code(), code);
    EXPECT_EQ(world.timeouts.size(), 1U);
    EXPECT_EQ(link.refusal().code(), code);
    link.TryAgain();
    EXPECT_TRUE(link.Wait(milliseconds(60'000)));
  }
}

TEST(AtlasLinkTest, AnotherAtlasIsRefused) {
  LinkWorld world;
  AtlasLink link({.connection = {}, .atlas_id = Bytes(16, 'z')}, world.environment());
  EXPECT_EQ(link.Wait(milliseconds(10)).error().code(), StatusCode::kConflict);
  EXPECT_EQ(link.refusal().code(), StatusCode::kConflict);
}

TEST(AtlasLinkTest, ABrokenLinkIsDroppedARefusedRequestIsNot) {
  LinkWorld world;
  AtlasLink link({}, world.environment());
  ASSERT_TRUE(link.Client(milliseconds(10)));
  link.Report({StatusCode::kNotFound, "no such session"});
  EXPECT_TRUE(link.is_connected());
  link.Report({StatusCode::kTimeout, "silent"});
  EXPECT_FALSE(link.is_connected());
  EXPECT_TRUE(link.refusal().ok());
  EXPECT_FALSE(link.Client(milliseconds(10)));  // not at once
}

}  // namespace
}  // namespace atlas
