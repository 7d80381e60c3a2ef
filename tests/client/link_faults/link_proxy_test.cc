// That the link does what its plan says: the tests over it see no more than what it does.
#include "tests/client/support/link_proxy.h"

#include <cerrno>
#include <chrono>
#include <future>

#include <gtest/gtest.h>

#include "tests/client/support/test_peer.h"
#include "tests/server/net/blocking_peer.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

wire::Envelope Message(std::uint64_t id) {
  wire::Envelope message;
  message.set_request_id(id);
  message.mutable_status_request();
  return message;
}

const auto kFrameBytes = static_cast<std::int64_t>(EncodeEnvelopeFrame(Message(1))->size());

// A daemon that says two frames and waits until it is left.
void SayTwo(PeerSocket& client) {
  client.Reply(1, Message(1));
  client.Reply(2, Message(2));
  client.Drain();
}

TEST(LinkProxyTest, SoManyBytesComeAndNoMore) {
  for (const LinkCut::Kind kind : {LinkCut::Kind::kClose, LinkCut::Kind::kHalfClose}) {
    TestPeer daemon(SayTwo);
    const LinkCut in_the_second{.after_bytes = kFrameBytes + 5, .kind = kind};
    LinkProxy proxy(daemon.endpoint(), {.down = in_the_second, .is_recorded = true});
    {
      BlockingPeer client(proxy.endpoint().port);
      EXPECT_EQ(client.Receive().value_or(Message(0)).request_id(), 1U);
      EXPECT_TRUE(client.IsClosed());
    }
    EXPECT_EQ(proxy.Passed().size(), in_the_second.after_bytes);
    EXPECT_EQ(proxy.totals().cuts, 1U);
  }
}

TEST(LinkProxyTest, AResetReachesBothEnds) {
  std::promise<bool> could_write;
  TestPeer daemon([&](PeerSocket& client) {
    client.ReadRequest();
    client.Drain();
    could_write.set_value(client.Write(Bytes(1, 7)));
  });
  LinkProxy proxy(daemon.endpoint(),
                  {.up = {.after_bytes = kFrameBytes, .kind = LinkCut::Kind::kReset}});
  BlockingPeer client(proxy.endpoint().port);
  EXPECT_TRUE(client.Send(Message(1)));
  EXPECT_TRUE(client.IsClosed());
  EXPECT_EQ(errno, ECONNRESET);
  EXPECT_FALSE(could_write.get_future().get());
}

TEST(LinkProxyTest, HalfClosedTheOtherWayGoesOn) {
  TestPeer daemon([](PeerSocket& client) {
    EXPECT_FALSE(client.ReadRequest());  // it was cut in its middle
    client.Reply(2, Message(2));
  });
  LinkProxy proxy(daemon.endpoint(), {.up = {.after_bytes = 5, .kind = LinkCut::Kind::kHalfClose}});
  BlockingPeer client(proxy.endpoint().port);
  EXPECT_TRUE(client.Send(Message(1)));
  EXPECT_EQ(client.Receive().value_or(Message(0)).request_id(), 2U);
}

TEST(LinkProxyTest, AStallAndALatencyTakeTheirTime) {
  constexpr milliseconds kStall{150};
  constexpr milliseconds kLatency{20};
  TestPeer daemon(SayTwo);
  LinkPlan plan{.pace = {.latency = kLatency}};
  plan.down = {.after_bytes = kFrameBytes, .kind = LinkCut::Kind::kClose, .stall = kStall};
  LinkProxy proxy(daemon.endpoint(), plan);
  const Clock::time_point begin = Clock::now();
  BlockingPeer client(proxy.endpoint().port);
  ASSERT_TRUE(client.Receive());
  EXPECT_GE(Clock::now() - begin, 3 * kLatency);  // there, back, and the frame
  ASSERT_TRUE(client.Receive());
  EXPECT_GE(Clock::now() - begin, kStall);
  EXPECT_TRUE(client.IsClosed());
}

TEST(LinkProxyTest, NobodyListensWhileItRefuses) {
  constexpr milliseconds kRefused{200};
  TestPeer daemon(SayTwo);
  LinkProxy proxy(daemon.endpoint(), {.down = {.after_bytes = 1}, .refused_after = kRefused});
  const auto is_taken = [&] {
    return BlockingPeer(proxy.endpoint().port).is_connected();
  };
  EXPECT_TRUE(BlockingPeer(proxy.endpoint().port).IsClosed());
  const Clock::time_point begin = Clock::now();
  bool is_refused = false;
  while (!is_taken()) {
    is_refused = true;
    ASSERT_LT(Clock::now() - begin, 50 * kRefused);
  }
  EXPECT_TRUE(is_refused);
  EXPECT_GE(Clock::now() - begin, kRefused / 2);
  EXPECT_EQ(proxy.totals().refusals, 1U);
}

}  // namespace
}  // namespace atlas::testing
