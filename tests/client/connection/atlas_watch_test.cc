// A watch beside other requests of its connection, against a peer that says what a test wants.
#include "client/connection/atlas_watch.h"

#include <functional>

#include <gtest/gtest.h>

#include "client/connection/atlas_client.h"
#include "proto/wire/convert.h"
#include "tests/client/support/test_peer.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPatience{5'000};
const WatchQuery kAround{.area = DiscArea{{1.5, -2.0}, 100.0},
                         .finest_level = 1,
                         .coarsest_level = 3,
                         .interval = milliseconds(250)};

void Greet(PeerSocket& socket, std::uint32_t minor = kProtocolMinor) {
  wire::Envelope hello;
  hello.mutable_hello_reply()->set_protocol_major(kProtocolMajor);
  hello.mutable_hello_reply()->set_protocol_minor(minor);
  hello.mutable_hello_reply()->set_profile(ProfileToWire({}));
  socket.Reply(socket.ReadRequest()->request_id(), std::move(hello));
}

// Of a tile in the column x; revision 0: it is no more.
wire::Envelope Event(std::uint64_t revision, std::int32_t x, std::uint64_t of_tile) {
  wire::Envelope envelope;
  wire::WatchEvent& event = *envelope.mutable_watch_event();
  event.set_revision(revision);
  event.add_keys(TileId{1, x, 0}.Key());
  event.add_revisions(of_tile);
  return envelope;
}

wire::Envelope Beginning(std::uint64_t revision) {
  wire::Envelope envelope;
  envelope.mutable_watch_event()->set_revision(revision);
  return envelope;
}

wire::Envelope Refusal(StatusCode code) {
  wire::Envelope envelope;
  *envelope.mutable_error() = ErrorToWire({code, "no more"});
  return envelope;
}

// Answers a status request.
void AnswerStatus(PeerSocket& socket) {
  const auto request = socket.ReadRequest();
  ASSERT_TRUE(request && request->has_status_request());
  wire::Envelope reply;
  reply.mutable_status_reply()->set_tiles(42);
  socket.Reply(request->request_id(), std::move(reply));
}

TEST(AtlasWatchTest, AsksForTheAreaAndTellsWhatCame) {
  wire::WatchRequest asked;
  TestPeer peer([&asked](PeerSocket& socket) {
    Greet(socket);
    const auto request = socket.ReadRequest();
    asked = request->watch_request();
    socket.Reply(request->request_id(), Beginning(7));
    socket.Reply(request->request_id(), Event(9, 3, 8));
    socket.Drain();
  });
  {
    auto client = AtlasClient::Connect(peer.options());
    ASSERT_TRUE(client) << client.error().message();
    auto watch = client->Watch(kAround, kPatience);
    ASSERT_TRUE(watch) << watch.error().message();
    EXPECT_FALSE(watch->since());
    AreaChanges all;
    while (all.revision < 9) {
      const auto changes = watch->Next(kPatience);
      ASSERT_TRUE(changes && *changes);
      EXPECT_EQ(watch->since(), 7U);
      all.Add(**changes);
    }
    EXPECT_EQ(all.changed, (std::map<TileId, std::uint64_t>{{{1, 3, 0}, 8}}));
    EXPECT_TRUE(all.removed.empty() && all.below.empty() && !all.is_anything);
    // Longer than a request may take: silence is no failure.
    const auto nothing = watch->Next(milliseconds(400));
    ASSERT_TRUE(nothing) << nothing.error().message();
    EXPECT_FALSE(*nothing);
    EXPECT_FALSE(client->is_broken());
  }
  EXPECT_EQ(asked.area().disc().center().x_um(), 1'500'000);
  EXPECT_EQ(asked.finest_level(), 1U);
  EXPECT_EQ(asked.coarsest_level(), 3U);
  EXPECT_EQ(asked.interval_ms(), 250U);
}

TEST(AtlasWatchTest, WhatComesDuringOtherRequestsIsKeptAsOne) {
  TestPeer peer([](PeerSocket& socket) {
    Greet(socket);
    const std::uint64_t id = socket.ReadRequest()->request_id();
    socket.Reply(id, Beginning(7));
    for (std::uint64_t revision = 8; revision < 11; ++revision) {
      socket.Reply(id, Event(revision, 3, revision));
    }
    socket.Reply(id, Event(11, 4, 11));
    socket.Reply(id, Event(12, 4, 0));
    socket.Reply(id, Event(13, 5, 0));
    socket.Reply(id, Event(14, 5, 14));
    AnswerStatus(socket);
    socket.Drain();
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  auto watch = client->Watch(kAround, kPatience);
  ASSERT_TRUE(watch);
  const auto status = client->ReadStatus();
  ASSERT_TRUE(status) << status.error().message();
  EXPECT_EQ(status->tiles, 42U);
  const auto changes = watch->Next(milliseconds(0));
  ASSERT_TRUE(changes && *changes);
  EXPECT_EQ((*changes)->revision, 14U);
  EXPECT_EQ((*changes)->changed,
            (std::map<TileId, std::uint64_t>{{{1, 3, 0}, 10}, {{1, 5, 0}, 14}}));
  EXPECT_EQ((*changes)->removed, (std::set<TileId>{{1, 4, 0}}));
}

TEST(AtlasWatchTest, WhatIsToldWithoutItsTilesIsToldOn) {
  TestPeer peer([](PeerSocket& socket) {
    Greet(socket);
    const std::uint64_t id = socket.ReadRequest()->request_id();
    wire::Envelope below = Beginning(8);
    below.mutable_watch_event()->add_below(TileId{2, 1, 1}.Key());
    socket.Reply(id, std::move(below));
    AnswerStatus(socket);
    wire::Envelope anything = Beginning(9);
    anything.mutable_watch_event()->set_anything(true);
    socket.Reply(id, std::move(anything));
    socket.Drain();
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  auto watch = client->Watch(kAround, kPatience);
  ASSERT_TRUE(watch);
  auto changes = watch->Next(kPatience);
  ASSERT_TRUE(changes && *changes);
  EXPECT_EQ((*changes)->below, (std::set<TileId>{{2, 1, 1}}));
  EXPECT_FALSE((*changes)->is_anything);
  ASSERT_TRUE(client->ReadStatus());
  changes = watch->Next(kPatience);
  ASSERT_TRUE(changes && *changes);
  EXPECT_TRUE((*changes)->is_anything);
}

TEST(AtlasWatchTest, MoreThanIsKeptBecomesAnything) {
  AreaChanges kept;
  for (int i = 0; i < 1'024; ++i) {
    AreaChanges one;
    one.revision = static_cast<std::uint64_t>(i);
    one.changed[{0, i, 0}] = 1;
    kept.Add(one);
  }
  EXPECT_FALSE(kept.is_anything);
  EXPECT_EQ(kept.changed.size(), 1'024U);
  AreaChanges one;
  one.below.insert({3, 0, 0});
  kept.Add(one);
  EXPECT_TRUE(kept.is_anything);
  EXPECT_TRUE(kept.changed.empty() && kept.below.empty());
}

TEST(AtlasWatchTest, TheDaemonsEndIsToldBehindWhatCameAndLeavesTheConnection) {
  TestPeer peer([](PeerSocket& socket) {
    Greet(socket);
    const std::uint64_t id = socket.ReadRequest()->request_id();
    socket.Reply(id, Beginning(7));
    socket.Reply(id, Refusal(StatusCode::kUnavailable));
    AnswerStatus(socket);
    socket.Drain();
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  auto watch = client->Watch(kAround, kPatience);
  ASSERT_TRUE(watch);
  ASSERT_TRUE(client->ReadStatus());
  EXPECT_EQ(watch->end().code(), StatusCode::kUnavailable);
  const auto changes = watch->Next(kPatience);
  ASSERT_TRUE(changes && *changes);
  for (int again = 0; again < 2; ++again) {
    const auto over = watch->Next(kPatience);
    ASSERT_FALSE(over);
    EXPECT_EQ(over.error(), watch->end());
  }
  EXPECT_FALSE(client->is_broken());
  EXPECT_EQ(client->retry_after(), milliseconds(0)) << "other requests were not refused";
}

TEST(AtlasWatchTest, GoingOutOfScopeCancelsAndTheConnectionGoesOn) {
  std::uint64_t watched = 0;
  std::uint64_t cancelled = 0;
  TestPeer peer([&](PeerSocket& socket) {
    Greet(socket);
    watched = socket.ReadRequest()->request_id();
    socket.Reply(watched, Beginning(7));
    const auto cancel = socket.ReadRequest();
    cancelled = cancel->cancel_request().request_id();
    socket.Reply(watched, Event(9, 3, 8));  // crossed it
    socket.Reply(watched, Refusal(StatusCode::kUnavailable));
    wire::Envelope done;
    done.mutable_cancel_reply()->set_cancelled(true);
    socket.Reply(cancel->request_id(), std::move(done));
    AnswerStatus(socket);
    socket.Drain();
  });
  {
    auto client = AtlasClient::Connect(peer.options());
    ASSERT_TRUE(client);
    { ASSERT_TRUE(client->Watch(kAround, kPatience)); }
    const auto status = client->ReadStatus();
    ASSERT_TRUE(status) << status.error().message();
    EXPECT_EQ(client->retry_after(), milliseconds(0));
  }
  EXPECT_NE(watched, 0U);
  EXPECT_EQ(cancelled, watched);
}

TEST(AtlasWatchTest, WhatIsNoEventBreaksTheConnection) {
  wire::Envelope uneven = Event(9, 3, 8);
  uneven.mutable_watch_event()->add_keys(1);
  wire::Envelope no_tile = Beginning(9);
  no_tile.mutable_watch_event()->add_below(~0ULL);
  wire::Envelope other;
  other.mutable_status_reply();
  for (const wire::Envelope& reply : {uneven, no_tile, other}) {
    TestPeer peer([&reply](PeerSocket& socket) {
      Greet(socket);
      socket.Reply(socket.ReadRequest()->request_id(), reply);
      socket.Drain();
    });
    auto client = AtlasClient::Connect(peer.options());
    ASSERT_TRUE(client);
    auto watch = client->Watch(kAround, kPatience);
    ASSERT_TRUE(watch);
    const auto changes = watch->Next(kPatience);
    ASSERT_FALSE(changes);
    EXPECT_EQ(changes.error().code(), StatusCode::kInvalidData);
    EXPECT_TRUE(client->is_broken());
  }
}

TEST(AtlasWatchTest, ItEndsWithItsConnection) {
  TestPeer peer([](PeerSocket& socket) {
    Greet(socket);
    socket.Reply(socket.ReadRequest()->request_id(), Beginning(7));
  });
  std::optional<AtlasClient> client = *AtlasClient::Connect(peer.options());
  auto watch = client->Watch(kAround, kPatience);
  ASSERT_TRUE(watch);
  ASSERT_TRUE(watch->Next(kPatience));
  EXPECT_EQ(watch->Next(kPatience).error().code(), StatusCode::kUnavailable);
  EXPECT_TRUE(client->is_broken());
  EXPECT_TRUE(watch->end().ok()) << "the daemon did not say so";
  client.reset();
  EXPECT_EQ(watch->Next(kPatience).error().code(), StatusCode::kUnavailable);
}

// Events alone keep no request waiting.
TEST(AtlasWatchTest, AnAnswerThatIsDueIsMissedHoweverManyEventsCome) {
  TestPeer peer([](PeerSocket& socket) {
    Greet(socket);
    const std::uint64_t id = socket.ReadRequest()->request_id();
    socket.ReadRequest();
    while (socket.Write(EncodeEnvelopeFrame([id] {
                          wire::Envelope event = Beginning(7);
                          event.set_request_id(id);
                          return event;
                        }())
                            .value())) {
    }
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  auto watch = client->Watch(kAround, kPatience);
  ASSERT_TRUE(watch);
  EXPECT_EQ(client->ReadStatus().error().code(), StatusCode::kTimeout);
}

TEST(AtlasWatchTest, ADaemonThatKnowsNoWatchIsNotAsked) {
  TestPeer peer([](PeerSocket& socket) {
    Greet(socket, 4);
    socket.Drain();
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  EXPECT_EQ(client->Watch(kAround, kPatience).error().code(), StatusCode::kUnsupported);
}

}  // namespace
}  // namespace atlas
