// Watches of many tiles: what they keep has a bound, and their messages are not kept at all.
#include "server/net/requests/watch_memory.h"

#include <cstdint>
#include <memory>
#include <vector>

#include "server/net/requests/freed_memory.h"
#include "server/net/requests/peer.h"
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using std::chrono::seconds;

constexpr std::size_t kTiles = SyncArea::kMaxTiles;
constexpr std::size_t kAreaBytes = kTiles * sizeof(std::uint64_t);
constexpr std::size_t kBesides = 4'096;

class WatchMemoryTest : public NetTest {
 protected:
  static wire::Envelope WatchOf(std::uint64_t id) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    auto& keys = *envelope.mutable_watch_request()->mutable_area()->mutable_tiles();
    const std::uint64_t first = TileId{0, 0, 0}.Key();
    for (std::uint64_t i = 0; i < kTiles; ++i) {
      keys.add_keys(first + i);
    }
    return envelope;
  }
  static StatusCode Begin(BlockingPeer& peer, std::uint64_t id) {
    peer.Send(WatchOf(id));
    const auto reply = peer.Receive();
    EXPECT_TRUE(reply.has_value());
    return CodeOf(reply);
  }
  static void Cancel(BlockingPeer& peer, std::uint64_t id) {
    wire::Envelope cancel;
    cancel.set_request_id(id + 1'000);
    cancel.mutable_cancel_request()->set_request_id(id);
    peer.Send(cancel);
    for (int replies = 0; replies < 2; ++replies) {  // its end, and that it was cancelled
      ASSERT_TRUE(peer.Receive().has_value());
    }
  }
};

TEST_F(WatchMemoryTest, AllTogetherKeepNoMoreThanTheyMay) {
  net_.max_watched_bytes = 2 * (kAreaBytes + kBesides);
  Serve();
  const auto one = Connect();
  auto other = Connect();
  EXPECT_EQ(Begin(*one, 1), StatusCode::kOk);
  EXPECT_EQ(Begin(*other, 1), StatusCode::kOk);
  EXPECT_EQ(Begin(*one, 2), StatusCode::kResourceExhausted);
  EXPECT_EQ(Begin(*Connect(), 1), StatusCode::kResourceExhausted);
  Cancel(*one, 1);
  EXPECT_EQ(Begin(*one, 3), StatusCode::kOk) << "what a watch kept is free when it ends";
  EXPECT_EQ(Begin(*one, 4), StatusCode::kResourceExhausted);
  other->CloseSending();
  EXPECT_EQ(CodeOf(other->Receive()), StatusCode::kUnavailable);
  EXPECT_TRUE(other->IsClosed());
  EXPECT_EQ(Begin(*one, 5), StatusCode::kOk) << "and when its connection does";
}

TEST_F(WatchMemoryTest, SoDoThoseOfAConnection) {
  net_.max_connection_watched_bytes = kAreaBytes + kBesides;
  Serve();
  const auto one = Connect();
  EXPECT_EQ(Begin(*one, 1), StatusCode::kOk);
  EXPECT_EQ(Begin(*one, 2), StatusCode::kResourceExhausted);
  EXPECT_EQ(Begin(*Connect(), 1), StatusCode::kOk) << "others have their own";
  Cancel(*one, 1);
  EXPECT_EQ(Begin(*one, 3), StatusCode::kOk);
}

TEST_F(WatchMemoryTest, AsManyAsThereMayBeAreFewInBytes) {
  Serve();
  const auto peer = Connect();
  wire::Envelope watch;
  watch.mutable_watch_request()->mutable_area()->mutable_disc()->set_radius_um(1);
  for (std::uint64_t id = 1; id <= Peer::kMaxCancellable; ++id) {
    watch.set_request_id(id);
    peer->Send(watch);
    EXPECT_TRUE(peer->Receive()->has_watch_event());
  }
}

TEST_F(WatchMemoryTest, ItsMessageIsNotKept) {
  Serve();
  const auto peer = Connect();
  EXPECT_EQ(Begin(*peer, 1), StatusCode::kOk);
  ExpectHoldsNothing();
  EXPECT_EQ(server_->ReadFigures().in_flight, 1u);
}

TEST(WatchBudgetTest, GivesBackWhatItTookFromBoth) {
  FreedMemory freed({100, seconds(10)});
  WatchMemory memory(1'000, freed);
  ByteBudget one(700);
  ByteBudget other(700);
  auto taken = memory.Take(600, one, nullptr);
  ASSERT_TRUE(taken.has_value());
  EXPECT_FALSE(memory.Take(600, one, nullptr).has_value());
  EXPECT_FALSE(memory.Take(600, other, nullptr).has_value());
  EXPECT_EQ(other.taken_bytes(), 0u) << "a refused one takes from neither";
  taken->reset();
  EXPECT_EQ(memory.taken_bytes() + one.taken_bytes(), 0u);
  EXPECT_TRUE(memory.Take(600, other, nullptr).has_value());
}

TEST(WatchBudgetTest, OneNameLeavesRoomForOthers) {
  FreedMemory freed({100, seconds(10)});
  WatchMemory memory(1'000, freed);
  ByteBudget one(700);
  ByteBudget another(700);
  NameLimits limits;
  limits.watched_bytes = 300;
  const auto alice = std::make_shared<PeerShare>("alice", limits);
  auto taken = memory.Take(200, one, alice);
  ASSERT_TRUE(taken.has_value());
  const auto refused = memory.Take(200, another, alice);
  ASSERT_FALSE(refused.has_value());
  EXPECT_NE(refused.error().message().find("alice"), std::string::npos);
  EXPECT_EQ(another.taken_bytes(), 0u);
  EXPECT_TRUE(memory.Take(600, another, nullptr).has_value());
  taken->reset();
  EXPECT_EQ(alice->watched.taken_bytes(), 0u);
}

TEST(FreedMemoryTest, IsReturnedWhenItIsMuchAndNotOften) {
  const FreedMemory::Clock::time_point now{std::chrono::hours(1)};
  FreedMemory freed({100, seconds(10)});
  freed.Note(99);
  EXPECT_FALSE(freed.IsDue(now));
  freed.Note(1);
  EXPECT_TRUE(freed.IsDue(now));
  EXPECT_FALSE(freed.IsDue(now)) << "it was";
  freed.Note(1'000);
  EXPECT_FALSE(freed.IsDue(now + seconds(9)));
  EXPECT_TRUE(freed.IsDue(now + seconds(10)));
  EXPECT_FALSE(freed.IsDue(now + seconds(30)));
}

}  // namespace
}  // namespace atlas
