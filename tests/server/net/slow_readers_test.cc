// Peers that ask for much and read little of it: what waits for them is bounded, for each and for
// all together, and who takes nearly nothing is closed.
#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "server/net/stream/write_pace.h"
#include "server/store/tile_block.h"
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kRequests = 64;
constexpr std::size_t kPlanBytes = 512u << 10;  // set aside while one is made
constexpr std::size_t kFrameBytes = 64u << 10;  // of the tiles here none is as large
constexpr std::size_t kLeastBytes = 18u << 10;  // of a reply under way, whatever the others have

class SlowReadersTest : public NetTest {
 protected:
  void ServeTiles() {
    Serve();
    UploadDrive(12);
    Digest();
  }
  static wire::Envelope SyncOf(std::uint64_t id) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    envelope.mutable_sync_request()->mutable_area()->mutable_disc()->set_radius_um(1'000'000'000);
    return envelope;
  }
  // Hundreds of tiles, far from each other, so that a plan of all of them is more than frames may
  // take.
  void ServeManyTiles() {
    net_.max_queued_bytes = 4'096;
    Serve();
    for (std::uint32_t i = 0; i < 48; ++i) {
      UploadRequest upload = DriveUpload(i, "day-" + std::to_string(i));
      upload.pose = PoseOf({100.0 * i, 0.0, 1.8, 0.0});
      ASSERT_TRUE(Upload(std::move(upload)));
    }
    Digest();
  }
  // By somebody who holds as many tiles and blocks as there may be, all of them in the area, none
  // of which is there.
  static wire::Envelope ManyHeldSync(std::uint64_t id) {
    wire::Envelope envelope = SyncOf(id);
    wire::SyncRequest& sync = *envelope.mutable_sync_request();
    sync.mutable_area()->mutable_disc()->set_radius_um(90'000'000'000'000);
    wire::Held& held = *sync.add_held();
    const std::uint64_t first = TileId{0, 1 << 20, 1 << 20}.Key();
    for (std::uint64_t i = 0; i < HeldTiles::kMaxTiles; ++i) {
      held.add_keys(first + i);
      held.add_payload_hashes(i);
      held.add_blocks(TileBlockOf(first) - 1 - i);
      held.add_masks(1);
      held.add_digests(i);
    }
    return envelope;
  }
  // Of everything, again and again, as queries or as syncs.
  static Bytes RequestsFor(bool is_sync) {
    Bytes bytes;
    for (std::uint64_t id = 1; id <= kRequests; ++id) {
      const Bytes frame = EncodeEnvelopeFrame(is_sync ? SyncOf(id) : QueryOf(id)).value();
      bytes.insert(bytes.end(), frame.begin(), frame.end());
    }
    return bytes;
  }
};

TEST_F(SlowReadersTest, OneQueuesNoMoreThanItMay) {
  net_.max_queued_bytes = 64u << 10;
  ServeTiles();
  for (const bool is_sync : {false, true}) {
    const auto peer = Connect(4'096);
    peer->SendBytes(RequestsFor(is_sync));
    const std::uint64_t bound = net_.max_queued_bytes + kFrameBytes;
    const Queued queued = WaitUntilAtRest({.more_than = 0, .at_most = bound});
    EXPECT_GT(queued.at_rest, 0u);
    EXPECT_LE(queued.at_rest, bound);
    EXPECT_LE(queued.most, net_.max_queued_bytes + kFrameBytes + kPlanBytes);
  }
}

TEST_F(SlowReadersTest, AllTogetherQueueNoMoreThanTheyMay) {
  constexpr std::size_t kPeers = 40;
  net_.max_all_queued_bytes = 512u << 10;
  ServeTiles();
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  for (std::size_t i = 0; i < kPeers; ++i) {
    peers.push_back(Connect(4'096));
    peers.back()->SendBytes(RequestsFor(i % 2 == 0));
  }
  const std::uint64_t expected = net_.max_all_queued_bytes / 4;
  const std::uint64_t most = WaitUntilAtRest({.more_than = expected}).most;
  EXPECT_GT(most, expected);
  EXPECT_LE(most, net_.max_all_queued_bytes + kPeers * (kLeastBytes + kFrameBytes));
  // Another one gets all it asks for.
  const auto good = Connect();
  for (const wire::Envelope& request : {QueryOf(1), SyncOf(2)}) {
    good->Send(request);
    std::optional<wire::Envelope> reply;
    do {
      reply = good->Receive();
      ASSERT_TRUE(reply.has_value());
    } while (!reply->has_query_end() && !reply->has_sync_end());
  }
  peers.clear();
  const auto deadline = std::chrono::steady_clock::now() + seconds(30);
  while (server_->ReadFigures().queued_bytes > 0 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_EQ(server_->ReadFigures().queued_bytes, 0u);
}

// What is still to be sent is known, and that takes memory, too.
TEST_F(SlowReadersTest, WhatRepliesKeepCountsAsQueued) {
  ServeManyTiles();
  const std::uint64_t tiles = service_->ReadStatus()->counts.tiles;
  ASSERT_GT(tiles, 300u);
  for (const bool is_sync : {false, true}) {
    const auto peer = Connect(4'096);
    peer->SendBytes(RequestsFor(is_sync));
    const std::uint64_t bound = net_.max_queued_bytes + kFrameBytes + tiles * sizeof(SyncItem);
    // A query knows the tiles of one level.
    const std::uint64_t expected = is_sync ? 256 * sizeof(SyncItem) : tiles / 4 * 32;
    const std::uint64_t queued = WaitUntilAtRest({.more_than = expected, .at_most = bound}).at_rest;
    EXPECT_GT(queued, expected);
    EXPECT_LE(queued, bound);
  }
}

// It grows with the request, not with the room for it.
TEST_F(SlowReadersTest, WhatBecameOfWhatIsHeldCountsForTheRequest) {
  constexpr std::uint64_t kTold = 2 * sizeof(std::uint64_t) * HeldTiles::kMaxTiles;
  ServeTiles();
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  for (std::uint64_t i = 0; i < 3; ++i) {
    peers.push_back(Connect(4'096));
    peers.back()->Send(ManyHeldSync(i + 1));
  }
  EXPECT_TRUE(WaitFor([](const NetFigures& now) { return now.held_bytes >= 3 * kTold; }));
  const Queued queued = WaitUntilAtRest({.more_than = 0, .at_most = kTold / 2 - 1});
  EXPECT_LT(queued.at_rest, kTold / 2) << "not among replies";
  const std::uint64_t held = server_->ReadFigures().held_bytes;
  EXPECT_GE(held, 3 * kTold);
  EXPECT_LT(held, 4 * kTold) << "what was asked is gone";
  for (const auto& peer : peers) {
    const auto manifest = peer->Receive();
    ASSERT_TRUE(manifest && manifest->has_sync_manifest());
    EXPECT_EQ(manifest->sync_manifest().removed_size(), int{HeldTiles::kMaxTiles});
    EXPECT_EQ(manifest->sync_manifest().differing_blocks_size(), int{HeldTiles::kMaxBlocks});
  }
  ExpectHoldsNothing();
}

TEST_F(SlowReadersTest, WhatIsLeftOfARequestGoesWithItsPeer) {
  net_.drain = milliseconds(100);
  ServeTiles();
  auto leaves = Connect(4'096);
  leaves->Send(ManyHeldSync(1));
  EXPECT_TRUE(WaitFor(HoldsSomething));
  leaves.reset();
  ExpectHoldsNothing();
  const auto stays = Connect(4'096);
  stays->Send(ManyHeldSync(2));
  EXPECT_TRUE(WaitFor(HoldsSomething));
  StopServer();
}

TEST_F(SlowReadersTest, ASyncThatEndsByItsDeadlineIsCountedAsLate) {
  ServeTiles();
  const auto peer = Connect(4'096);
  wire::Envelope sync = ManyHeldSync(1);
  sync.mutable_sync_request()->set_timeout_ms(100);
  peer->Send(sync);
  EXPECT_TRUE(WaitFor(HoldsSomething));
  std::this_thread::sleep_for(milliseconds(500));  // longer than that
  std::optional<wire::Envelope> reply;
  do {
    reply = peer->Receive();
    ASSERT_TRUE(reply.has_value());
  } while (!reply->has_sync_end());
  EXPECT_FALSE(reply->sync_end().cursor().empty());
  EXPECT_EQ(server_->ReadFigures().kinds[static_cast<std::size_t>(RequestKind::kSync)].late, 1u);
}

// As when so many others read nothing that nothing is left to be shared.
TEST_F(SlowReadersTest, WhereAllIsTakenAReaderIsServedFrameByFrame) {
  net_.max_all_queued_bytes = 7;  // of which a share is nothing
  ServeTiles();
  for (const bool is_again : {false, true}) {  // read from disk, and ready
    const auto peer = Connect();
    std::uint64_t tiles = 0;
    for (const wire::Envelope& request : {QueryOf(1), SyncOf(2)}) {
      peer->Send(request);
      std::optional<wire::Envelope> reply;
      do {
        reply = peer->Receive();
        ASSERT_TRUE(reply.has_value()) << is_again;
        tiles += reply->has_tile() ? 1u : 0u;
      } while (!reply->has_query_end() && !reply->has_sync_end());
    }
    EXPECT_GT(tiles, 20u) << is_again;
  }
}

TEST_F(SlowReadersTest, RepliesOfOneConnectionAreMadeOneAfterTheOther) {
  net_.max_queued_bytes = 4'096;  // each is made in many steps
  ServeTiles();
  const auto peer = Connect(4'096);
  peer->SendBytes(RequestsFor(false));
  for (std::uint64_t id = 1; id <= kRequests; ++id) {
    std::optional<wire::Envelope> reply;
    do {
      reply = peer->Receive();
      ASSERT_TRUE(reply.has_value());
      ASSERT_EQ(reply->request_id(), id);
    } while (!reply->has_query_end());
  }
}

// It never stops for as long as a write may take: that alone once kept it.
TEST_F(SlowReadersTest, AReaderThatTakesNearlyNothingIsClosed) {
  net_.write_stall = milliseconds(500);
  net_.min_write_bytes_per_s = 64u << 20;
  ServeTiles();
  const auto peer = Connect(4'096);
  peer->SendBytes(RequestsFor(false));
  std::uint64_t ended = 0;
  while (const auto reply = peer->Receive()) {
    ended += reply->has_query_end() ? 1u : 0u;
    std::this_thread::sleep_for(milliseconds(2));
  }
  EXPECT_LT(ended, kRequests);
  ExpectServes();
  const NetFigures figures = server_->ReadFigures();
  EXPECT_EQ(figures.late_connections[static_cast<std::size_t>(Lateness::kReplies)], 1u);
  const auto& queries = figures.kinds[static_cast<std::size_t>(RequestKind::kQueryRegion)].requests;
  EXPECT_LE(queries[static_cast<std::size_t>(StatusCode::kOk)], kRequests - 1);
  EXPECT_GT(queries[static_cast<std::size_t>(StatusCode::kUnavailable)], 0u) << "no reply, not ok";
}

TEST(WritePaceTest, ASlowLinkIsBorneAndATrickleIsNot) {
  NetOptions options;
  const WritePace::Time start{};
  for (const auto& [bytes_per_s, is_too_slow] : {std::pair(2'000, false), std::pair(400, true)}) {
    WritePace pace(options);
    EXPECT_FALSE(pace.IsDue(start + seconds(3'600))) << "nothing waits";
    pace.Begin(start, 1'000);
    EXPECT_FALSE(pace.IsDue(start + seconds(60)));
    ASSERT_TRUE(pace.IsDue(start + seconds(61)));
    EXPECT_EQ(pace.WasTooSlow(start + seconds(61), 1'000 + 61 * bytes_per_s), is_too_slow);
    EXPECT_FALSE(pace.IsDue(start + seconds(100))) << "the next window";
    pace.End();
    EXPECT_FALSE(pace.IsDue(start + seconds(3'600)));
  }
}

// However fast the first megabytes went.
TEST(WritePaceTest, WhatWasTakenBeforeBuysNothing) {
  NetOptions options;
  const WritePace::Time start{};
  WritePace pace(options);
  pace.Begin(start, 0);
  EXPECT_FALSE(pace.WasTooSlow(start + seconds(61), 100'000'000));
  EXPECT_TRUE(pace.WasTooSlow(start + seconds(122), 100'000'000));
}

}  // namespace
}  // namespace atlas
