// Watches: what changed, told as it changes.
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "server/net/requests/peer.h"
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

class WatchTest : public NetTest {
 protected:
  static wire::Envelope WatchOf(std::uint64_t id, double radius_m = 1'000.0) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    auto& disc = *envelope.mutable_watch_request()->mutable_area()->mutable_disc();
    disc.set_radius_um(static_cast<std::uint64_t>(radius_m * 1e6));
    return envelope;
  }
  static wire::Envelope CancelOf(std::uint64_t id, std::uint64_t watch) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    envelope.mutable_cancel_request()->set_request_id(watch);
    return envelope;
  }
  // Of all tiles that there are.
  std::map<std::uint64_t, std::uint64_t> Revisions() {
    std::map<std::uint64_t, std::uint64_t> revisions;
    const auto tiles = store_->ListTiles(-1, 10'000);
    for (const TileSummary& tile : *tiles) {
      revisions[tile.id.Key()] = tile.revision;
    }
    return revisions;
  }
  // Adds events until they tell `expected` of these tiles.
  static void Follow(BlockingPeer& peer,
                     const std::map<std::uint64_t, std::uint64_t>& expected,
                     std::map<std::uint64_t, std::uint64_t>& told) {
    const auto is_told = [&] {
      for (const auto& [key, revision] : expected) {
        const auto found = told.find(key);
        if (found == told.end() || found->second != revision) {
          return false;
        }
      }
      return true;
    };
    while (!is_told()) {
      const auto reply = peer.Receive();
      ASSERT_TRUE(reply && reply->has_watch_event());
      const wire::WatchEvent& event = reply->watch_event();
      ASSERT_EQ(event.keys_size(), event.revisions_size());
      EXPECT_FALSE(event.keys_size() == 0 && event.below_size() == 0 && !event.anything());
      for (int i = 0; i < event.keys_size(); ++i) {
        EXPECT_TRUE(event.revisions(i) == 0 || event.revisions(i) > told[event.keys(i)]);
        told[event.keys(i)] = event.revisions(i);
      }
    }
  }
};

TEST_F(WatchTest, TellsEveryTileThatChanges) {
  Serve();
  UploadDrive(3);
  Digest();
  const auto before = Revisions();
  const auto peer = Connect();
  peer->Send(WatchOf(5));
  const auto first = peer->Receive();
  ASSERT_TRUE(first && first->has_watch_event());
  EXPECT_EQ(first->request_id(), 5u);
  EXPECT_EQ(first->watch_event().keys_size(), 0) << "nothing changed yet";
  UploadDrive(6);
  Digest();
  std::map<std::uint64_t, std::uint64_t> changed;
  for (const auto& [key, revision] : Revisions()) {
    const auto was = before.find(key);
    if (was == before.end() || was->second != revision) {
      changed[key] = revision;
    }
  }
  std::map<std::uint64_t, std::uint64_t> told;
  Follow(*peer, changed, told);
  for (const auto& [key, revision] : told) {
    EXPECT_TRUE(changed.contains(key)) << "a tile that is as it was";
  }
}

TEST_F(WatchTest, TellsTilesThatAreNoMore) {
  Serve();
  UploadDrive(3);
  Digest();
  auto gone = Revisions();
  for (auto& [key, revision] : gone) {
    revision = 0;
  }
  const auto peer = Connect();
  peer->Send(WatchOf(5));
  peer->Receive();
  ASSERT_TRUE(Change("day", SessionAction::kRetract).has_value());
  std::map<std::uint64_t, std::uint64_t> told;
  Follow(*peer, gone, told);
}

TEST_F(WatchTest, OnlyOfItsArea) {
  Serve();
  const auto peer = Connect();
  peer->Send(WatchOf(5, 4.0));
  peer->Receive();
  UploadDrive(8);
  Digest();
  wire::Envelope sync;
  sync.set_request_id(6);
  sync.mutable_sync_request()->mutable_area()->mutable_disc()->set_radius_um(4'000'000);
  const auto other = Connect();
  other->Send(sync);
  std::map<std::uint64_t, std::uint64_t> inside;
  for (auto reply = other->Receive(); !reply->has_sync_end(); reply = other->Receive()) {
    if (reply->has_tile()) {
      inside[reply->tile().key()] = reply->tile().revision();
    }
  }
  ASSERT_LT(inside.size(), Revisions().size());
  std::map<std::uint64_t, std::uint64_t> told;
  Follow(*peer, inside, told);
  EXPECT_EQ(told.size(), inside.size());
}

TEST_F(WatchTest, EndsWhenItIsCancelled) {
  Serve();
  const auto peer = Connect();
  peer->Send(WatchOf(5));
  peer->Receive();
  peer->Send(CancelOf(6, 5));
  peer->Send(CancelOf(7, 99));
  bool is_ended = false;
  for (int replies = 0; replies < 3; ++replies) {
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply.has_value());
    if (reply->request_id() == 5) {
      EXPECT_EQ(CodeOf(reply), StatusCode::kUnavailable);
      is_ended = true;
    } else {
      EXPECT_EQ(reply->cancel_reply().cancelled(), reply->request_id() == 6);
    }
  }
  EXPECT_TRUE(is_ended);
  peer->Send(WatchOf(5));
  EXPECT_TRUE(peer->Receive()->has_watch_event()) << "the id is free again";
}

TEST_F(WatchTest, ALongIntervalHoldsNoEndUp) {
  net_.max_watches = 1;
  Serve();
  wire::Envelope watch = WatchOf(5);
  watch.mutable_watch_request()->set_interval_ms(60'000);
  for (int i = 0; i < 3; ++i) {  // one place: each must be given back
    const auto peer = Connect();
    peer->Send(watch);
    ASSERT_TRUE(peer->Receive()->has_watch_event());
    peer->Send(CancelOf(6, 5));
    std::set<std::uint64_t> answered;
    for (int replies = 0; replies < 2; ++replies) {
      const auto reply = peer->Receive();
      ASSERT_TRUE(reply.has_value());
      answered.insert(reply->request_id());
    }
    EXPECT_EQ(answered, (std::set<std::uint64_t>{5, 6}));
  }
  const auto peer = Connect();
  peer->Send(watch);
  ASSERT_TRUE(peer->Receive()->has_watch_event());
  server_->Stop();
  EXPECT_TRUE(HasDrained());
}

TEST_F(WatchTest, EndsWithItsConnectionAndWithTheDaemon) {
  net_.max_watches = 1;
  Serve();
  for (int i = 0; i < 5; ++i) {  // one place: each must be given back
    const auto peer = Connect();
    peer->Send(WatchOf(1));
    ASSERT_TRUE(peer->Receive()->has_watch_event());
    peer->CloseSending();
    EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kUnavailable);
    EXPECT_TRUE(peer->IsClosed());
  }
  const auto peer = Connect();
  peer->Send(WatchOf(1));
  peer->Receive();
  server_->Stop();
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kUnavailable);
  EXPECT_TRUE(peer->IsClosed());
  EXPECT_TRUE(HasDrained());
}

TEST_F(WatchTest, TooManyAreRefusedAndCanStillBeCancelled) {
  Serve();
  const auto peer = Connect();
  for (std::uint64_t id = 1; id <= Peer::kMaxCancellable; ++id) {
    peer->Send(WatchOf(id));
    ASSERT_TRUE(peer->Receive()->has_watch_event());
  }
  peer->Send(WatchOf(1));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
  peer->Send(WatchOf(500));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
  peer->Send(CancelOf(600, 3));
  std::set<std::uint64_t> answered;
  for (int replies = 0; replies < 2; ++replies) {
    answered.insert(peer->Receive()->request_id());
  }
  EXPECT_EQ(answered, (std::set<std::uint64_t>{3, 600}));
}

TEST_F(WatchTest, AnAreaOrLevelsThatMakeNoSenseAreRefused) {
  Serve();
  const auto peer = Connect();
  wire::Envelope nowhere;
  nowhere.set_request_id(1);
  nowhere.mutable_watch_request();
  peer->Send(nowhere);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
  wire::Envelope levels = WatchOf(2);
  levels.mutable_watch_request()->set_finest_level(9);
  peer->Send(levels);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
}

// It reads nothing while much changes: it is told less, the others wait for nothing.
TEST_F(WatchTest, ASlowWatcherHoldsNobodyUp) {
  Serve();
  const auto slow = Connect(4'096);
  slow->Send(WatchOf(1));
  for (int i = 0; i < 3; ++i) {
    UploadDrive(12);
    Digest();
    ASSERT_TRUE(Change("day", SessionAction::kRetract).has_value());
    Digest();
    ASSERT_TRUE(Change("day", SessionAction::kRestore).has_value());
    Digest();
  }
  ExpectServes();
  slow->Receive();
  std::map<std::uint64_t, std::uint64_t> told;
  Follow(*slow, Revisions(), told);
}

}  // namespace
}  // namespace atlas
