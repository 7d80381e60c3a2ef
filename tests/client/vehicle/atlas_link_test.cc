// Attempts, pauses and refusals, with a clock that stands still unless somebody sleeps.
#include "client/vehicle/atlas_link.h"

#include <deque>
#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/wire/convert.h"
#include "tests/client/vehicle/sync_peer.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

// Attempts that fail as scripted; at the script's end they succeed.
class LinkWorld {
 public:
  std::deque<Status> failures;
  double random = 0.999999;
  milliseconds retry_after{0};  // that failures ask for
  bool is_final = false;        // that failures are
  int slow_calls = 0;           // after which an attempt ends
  int attempts = 0;
  std::vector<milliseconds> pauses;
  std::vector<milliseconds> timeouts;  // of each call

  LinkEnvironment environment() {
    return {[this] { return now_; },
            [this](milliseconds pause) {
              pauses.push_back(pause);
              now_ += pause;
            },
            [this] { return random; },
            [this](const ConnectionOptions&) {
              ++attempts;
              return [this](milliseconds time) {
                return Continue(time);
              };
            }};
  }
  void Pass(milliseconds time) { now_ += time; }

 private:
  ConnectProgress Continue(milliseconds time) {
    timeouts.push_back(time);
    ConnectProgress progress;
    if (slow_calls-- > 0) return progress;
    if (failures.empty()) {
      progress.client = std::move(*AtlasClient::Connect(peer_.options()));
      return progress;
    }
    progress.failure = failures.front();
    progress.retry_after = retry_after;
    progress.is_final = is_final;
    failures.pop_front();
    return progress;
  }

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
    socket.ReadRequest();  // and closes
  });
  LinkWorld world;
  world.random = 0.0;
  LinkEnvironment environment = world.environment();
  environment.connect = [&busy](const ConnectionOptions&) {
    const auto attempt = std::make_shared<ConnectAttempt>(busy.options());
    return [attempt](milliseconds) {
      return attempt->Continue(milliseconds(2'000));
    };
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
  EXPECT_TRUE(link.is_connected()) << "it only refused";
  link.Report((*client)->ReadStatus().error());
  EXPECT_FALSE(link.is_connected());
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

TEST(AtlasLinkTest, AnAttemptGoesOnInTheNextCall) {
  LinkWorld world;
  world.slow_calls = 5;
  AtlasLink link({}, world.environment());
  for (int call = 0; call < 5; ++call) {
    const auto client = link.Client(milliseconds(50));
    ASSERT_FALSE(client);
    EXPECT_EQ(client.error().code(), StatusCode::kUnavailable);
    EXPECT_NE(client.error().message().find("connecting"), std::string::npos);
  }
  EXPECT_TRUE(link.Client(milliseconds(50)));
  EXPECT_EQ(world.attempts, 1);
  EXPECT_EQ(world.timeouts, std::vector<milliseconds>(6, milliseconds(50)));
}

TEST(AtlasLinkTest, AnAttemptThatFailsInALaterCallBacksOff) {
  LinkWorld world;
  world.slow_calls = 1;
  world.failures = {kAway};
  AtlasLink link({}, world.environment());
  EXPECT_FALSE(link.Client(milliseconds(50)));
  EXPECT_EQ(link.Client(milliseconds(50)).error(), kAway);
  EXPECT_FALSE(link.Client(milliseconds(50)));
  EXPECT_EQ(world.attempts, 1);
  world.Pass(milliseconds(500));
  EXPECT_TRUE(link.Client(milliseconds(50)));
  EXPECT_EQ(world.attempts, 2);
}

TEST(AtlasLinkTest, WhatWillFailAgainIsNotTriedAgain) {
  for (const StatusCode code : {StatusCode::kInvalidData, StatusCode::kUnsupported}) {
    LinkWorld world;
    world.failures = {{code, "never"}};
    world.is_final = true;
    AtlasLink link({}, world.environment());
    EXPECT_EQ(link.Wait(milliseconds(60'000)).error().code(), code);
    EXPECT_EQ(link.Wait(milliseconds(60'000)).error().code(), code);
    EXPECT_EQ(world.attempts, 1);
    EXPECT_EQ(link.refusal().code(), code);
    link.TryAgain();
    EXPECT_TRUE(link.Wait(milliseconds(60'000)));
  }
}

// A captive portal, a proxy without its daemon.
TEST(AtlasLinkTest, AnAnswerThatMakesNoSenseIsABrokenLink) {
  LinkWorld world;
  world.failures = {{StatusCode::kInvalidData, "not a frame"}};
  AtlasLink link({}, world.environment());
  EXPECT_FALSE(link.Client(milliseconds(50)));
  EXPECT_TRUE(link.refusal().ok());
  EXPECT_TRUE(link.Wait(milliseconds(1'000)));
  EXPECT_EQ(world.attempts, 2);
}

TEST(AtlasLinkTest, AMissingPermissionIsAskedForOnceAMinute) {
  const Status denied(StatusCode::kPermissionDenied, "who are you?");
  LinkWorld world;
  world.failures.assign(3, denied);
  AtlasLink link({}, world.environment());
  EXPECT_EQ(link.Wait(milliseconds(1'000)).error(), denied) << "at once: no attempt comes within";
  EXPECT_TRUE(link.refusal().ok());
  world.random = 0.0;
  EXPECT_TRUE(link.Wait(milliseconds(300'000)));
  ASSERT_EQ(world.pauses.size(), 3U);
  EXPECT_NEAR(static_cast<double>(world.pauses[0].count()), 60'000, 1.0);
  EXPECT_EQ(world.pauses[1], milliseconds(30'000));
  EXPECT_EQ(world.pauses[2], milliseconds(30'000));
}

TEST(AtlasLinkTest, AnotherAtlasIsRefused) {
  LinkWorld world;
  AtlasLink link({.connection = {}, .atlas_id = Bytes(16, 'z')}, world.environment());
  EXPECT_EQ(link.Wait(milliseconds(10)).error().code(), StatusCode::kConflict);
  EXPECT_EQ(link.refusal().code(), StatusCode::kConflict);
}

// A link to a peer that serves one connection after its greeting.
class LinkToPeer {
 public:
  explicit LinkToPeer(std::function<void(PeerSocket&)> serve)
      : peer_([serve = std::move(serve)](PeerSocket& socket) {
          AnswerHello(socket, {});
          serve(socket);
        }) {}

  // What a status request came to, reported to the link.
  Status Ask() {
    const auto client = link_.Client(milliseconds(2'000));
    if (!client) return client.error();
    const auto reply = (*client)->ReadStatus();
    const Status status = reply ? Status() : reply.error();
    link_.Report(status);
    return status;
  }
  AtlasLink& link() { return link_; }

 private:
  TestPeer peer_;
  AtlasLink link_{LinkOptions{.connection = peer_.options()}};
};

TEST(AtlasLinkTest, WhateverTheDaemonRefusesTheLinkStays) {
  const std::vector<StatusCode> codes = {StatusCode::kUnavailable, StatusCode::kTimeout,
                                         StatusCode::kInvalidData, StatusCode::kResourceExhausted,
                                         StatusCode::kInternal};
  LinkToPeer peer([codes](PeerSocket& socket) {
    for (std::size_t asked = 0; const auto request = socket.ReadRequest(); ++asked) {
      wire::Envelope reply;
      if (asked < codes.size()) {
        *reply.mutable_error() = ErrorToWire({codes[asked], "not this"});
      } else {
        reply.mutable_status_reply();
      }
      socket.Reply(request->request_id(), std::move(reply));
    }
  });
  for (const StatusCode code : codes) {
    ASSERT_EQ(peer.Ask().code(), code);
    ASSERT_TRUE(peer.link().is_connected());
  }
  EXPECT_TRUE(peer.Ask().ok()) << "on the same connection: the peer takes no other";
}

TEST(AtlasLinkTest, WhatBreaksTheConnectionDropsIt) {
  const auto answer_under = [](std::uint64_t id, wire::Envelope reply) {
    return [id, reply](PeerSocket& socket) {
      socket.ReadRequest();
      socket.Reply(id, reply);
      socket.Drain();
    };
  };
  wire::Envelope refused;
  *refused.mutable_error() = ErrorToWire({StatusCode::kUnavailable, "full"});
  wire::Envelope other;
  other.mutable_wait_reply();
  wire::Envelope status;
  status.mutable_status_reply();
  const std::vector<std::pair<std::function<void(PeerSocket&)>, StatusCode>> peers = {
      {[](PeerSocket& socket) { socket.ReadRequest(); }, StatusCode::kUnavailable},
      {[](PeerSocket& socket) { socket.Drain(); }, StatusCode::kTimeout},
      {[](PeerSocket& socket) {
         socket.ReadRequest();
         socket.Write(Bytes(20, 'x'));
         socket.Drain();
       },
       StatusCode::kInvalidData},
      {answer_under(0, refused), StatusCode::kUnavailable},
      {answer_under(2, other), StatusCode::kInvalidData},
      {answer_under(77, status), StatusCode::kInvalidData},
  };
  for (std::size_t i = 0; i < peers.size(); ++i) {
    LinkToPeer peer(peers[i].first);
    EXPECT_EQ(peer.Ask().code(), peers[i].second) << i;
    EXPECT_FALSE(peer.link().is_connected()) << i;
    EXPECT_TRUE(peer.link().refusal().ok()) << i;
  }
}

TEST(AtlasLinkTest, WhatSomebodySaysOfAGoodConnectionDoesNotDropIt) {
  LinkWorld world;
  AtlasLink link({}, world.environment());
  ASSERT_TRUE(link.Client(milliseconds(10)));
  link.Report({StatusCode::kTimeout, "nothing came of it"});
  EXPECT_TRUE(link.is_connected());
}

}  // namespace
}  // namespace atlas
