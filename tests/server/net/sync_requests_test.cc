// Syncs over a real socket: what is announced comes, within the budget, once, and nothing else.
#include <algorithm>
#include <map>
#include <set>

#include "core/base/hash.h"
#include "core/tile/tile_codec.h"
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

struct SyncReply {
  wire::SyncManifest holdings;  // the first manifest
  std::vector<wire::TileMessage> tiles;
  std::uint64_t bytes = 0;  // of all frames
  wire::SyncEnd end;
  StatusCode refusal = StatusCode::kOk;
};

class SyncTest : public NetTest {
 protected:
  static wire::Envelope SyncOf(std::uint64_t request_id, double radius_m = 1'000.0) {
    wire::Envelope envelope;
    envelope.set_request_id(request_id);
    wire::Area::Disc& disc = *envelope.mutable_sync_request()->mutable_area()->mutable_disc();
    disc.mutable_center();
    disc.set_radius_um(static_cast<std::uint64_t>(radius_m * 1e6));
    return envelope;
  }

  // Checks what any reply must be.
  static SyncReply Receive(BlockingPeer& peer, std::uint64_t request_id) {
    SyncReply sync;
    wire::SyncManifest manifest;
    int announced = 0;  // of the manifest at hand, tiles that came
    for (int frame = 0;; ++frame) {
      std::size_t size_bytes = 0;
      const std::optional<wire::Envelope> reply = peer.Receive(&size_bytes);
      if (!reply || reply->request_id() != request_id) {
        ADD_FAILURE() << "no end of the reply";
        return sync;
      }
      sync.bytes += size_bytes;
      if (reply->has_error()) {
        sync.refusal = CodeOf(reply);
        return sync;
      }
      if (reply->has_tile()) {
        const wire::TileMessage& tile = reply->tile();
        if (announced >= manifest.keys_size()) {
          ADD_FAILURE() << "a tile that was not announced";
          return sync;
        }
        EXPECT_EQ(manifest.keys(announced), tile.key());
        EXPECT_EQ(manifest.revisions(announced), tile.revision());
        EXPECT_EQ(manifest.payload_hashes(announced), tile.payload_hash());
        EXPECT_EQ(manifest.bytes(announced), tile.blob().size());
        ++announced;
        sync.tiles.push_back(tile);
        continue;
      }
      EXPECT_EQ(announced, manifest.keys_size()) << "tiles that were announced did not come";
      announced = 0;
      if (reply->has_sync_manifest()) {
        manifest = reply->sync_manifest();
        if (frame == 0) {
          sync.holdings = manifest;
        } else {
          EXPECT_GT(manifest.keys_size(), 0);
        }
        continue;
      }
      EXPECT_TRUE(reply->has_sync_end()) << reply->ShortDebugString();
      sync.end = reply->sync_end();
      EXPECT_EQ(sync.end.bytes(), sync.bytes);
      EXPECT_EQ(sync.end.tiles(), sync.tiles.size());
      EXPECT_GT(frame, 0) << "a reply begins with a manifest";
      return sync;
    }
  }
  static SyncReply Ask(BlockingPeer& peer, const wire::Envelope& request) {
    EXPECT_TRUE(peer.Send(request));
    return Receive(peer, request.request_id());
  }

  static std::set<std::uint64_t> KeysOf(const std::vector<wire::TileMessage>& tiles) {
    std::set<std::uint64_t> keys;
    for (const wire::TileMessage& tile : tiles) {
      EXPECT_TRUE(keys.insert(tile.key()).second) << "twice";
    }
    return keys;
  }
  std::vector<TileSummary> StoredTiles() const { return store_->ListTiles(-1, 100'000).value(); }
  std::set<std::uint64_t> StoredKeys() const {
    std::set<std::uint64_t> keys;
    for (const TileSummary& tile : StoredTiles()) {
      keys.insert(tile.id.Key());
    }
    return keys;
  }
  static void Hold(const std::vector<wire::TileMessage>& tiles, wire::Envelope& request) {
    wire::Held& held = *request.mutable_sync_request()->add_held();
    for (const wire::TileMessage& tile : tiles) {
      held.add_keys(tile.key());
      held.add_payload_hashes(tile.payload_hash());
    }
  }
};

TEST_F(SyncTest, EverythingComesCoarseFirstAsItIsStored) {
  Serve();
  UploadDrive(8);
  Digest();
  const auto peer = Connect();
  const SyncReply sync = Ask(*peer, SyncOf(3));
  EXPECT_EQ(KeysOf(sync.tiles), StoredKeys());
  EXPECT_EQ(sync.end.cursor(), "");
  EXPECT_EQ(sync.end.revision(), service_->revision());
  std::set<std::uint64_t> sent;
  for (const wire::TileMessage& tile : sync.tiles) {
    const TileId id = TileId::FromKey(tile.key()).value();
    EXPECT_TRUE(id.level + 1 == TestProfile().levels || sent.contains(id.Parent().Key()));
    sent.insert(tile.key());
    EXPECT_EQ(tile.blob(), BytesToWire(store_->ReadTile(id).value()->blob));
  }
  ASSERT_GT(sync.holdings.errors_mm_size(), 0);
  EXPECT_EQ(sync.holdings.errors_mm(0),
            TestProfile().cell_size_um / 1'000u << (TestProfile().levels - 1));
}

TEST_F(SyncTest, ABudgetIsKeptAndTheCursorGoesOn) {
  Serve();
  UploadDrive(8);
  Digest();
  const auto peer = Connect();
  const SyncReply whole = Ask(*peer, SyncOf(3));
  for (const std::uint64_t budget : {2'000u, 5'000u, 20'000u, 100'000u}) {
    wire::Envelope request = SyncOf(4);
    request.mutable_sync_request()->set_budget_bytes(budget);
    std::vector<wire::TileMessage> tiles;
    for (int replies = 0; replies < 1'000; ++replies) {
      const SyncReply part = Ask(*peer, request);
      ASSERT_EQ(part.refusal, StatusCode::kOk);
      EXPECT_LE(part.bytes, budget);
      tiles.insert(tiles.end(), part.tiles.begin(), part.tiles.end());
      if (part.end.cursor().empty()) {
        break;
      }
      if (part.tiles.empty()) {  // the next one is larger than the budget
        EXPECT_LT(budget, 20'000u);
        break;
      }
      request.mutable_sync_request()->set_cursor(part.end.cursor());
    }
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      EXPECT_EQ(tiles[i].key(), whole.tiles[i].key());
    }
    EXPECT_TRUE(tiles.size() == whole.tiles.size() || budget < 20'000u);
  }
}

TEST_F(SyncTest, ABudgetWithoutRoomForAnythingIsRefused) {
  Serve();
  const auto peer = Connect();
  wire::Envelope request = SyncOf(4);
  request.mutable_sync_request()->set_budget_bytes(100);
  EXPECT_EQ(Ask(*peer, request).refusal, StatusCode::kInvalidArgument);
}

TEST_F(SyncTest, NothingComesTwice) {
  Serve();
  UploadDrive(8);
  Digest();
  const auto peer = Connect();
  const SyncReply whole = Ask(*peer, SyncOf(3));
  wire::Envelope again = SyncOf(4);
  Hold(whole.tiles, again);
  const SyncReply nothing = Ask(*peer, again);
  EXPECT_TRUE(nothing.tiles.empty());
  EXPECT_EQ(nothing.holdings.not_modified(), whole.tiles.size());
  EXPECT_EQ(nothing.holdings.current_tiles().size(), (whole.tiles.size() + 7) / 8);
  EXPECT_LT(nothing.bytes, 300u);

  ASSERT_TRUE(Upload(DriveUpload(12)).has_value());  // ahead of the others
  Digest();
  std::map<std::uint64_t, std::uint64_t> held;
  for (const wire::TileMessage& tile : whole.tiles) {
    held[tile.key()] = tile.payload_hash();
  }
  std::set<std::uint64_t> changed;
  for (const TileSummary& tile : StoredTiles()) {
    const auto found = held.find(tile.id.Key());
    if (found == held.end() || found->second != tile.payload_hash) {
      changed.insert(tile.id.Key());
    }
  }
  const SyncReply news = Ask(*peer, again);
  EXPECT_FALSE(changed.empty());
  EXPECT_EQ(KeysOf(news.tiles), changed);
}

TEST_F(SyncTest, BlocksOfTilesAreComparedByTheirDigests) {
  Serve();
  UploadDrive(8);
  Digest();
  const auto peer = Connect();
  const SyncReply whole = Ask(*peer, SyncOf(3));
  std::map<std::uint64_t, std::uint64_t> tiles;
  for (const wire::TileMessage& tile : whole.tiles) {
    tiles[tile.key()] = tile.payload_hash();
  }
  wire::Envelope request = SyncOf(4);
  wire::Held& held = *request.mutable_sync_request()->add_held();
  for (const auto& [key, hash] : tiles) {
    if (held.blocks_size() == 0 || held.blocks(held.blocks_size() - 1) != key >> 6) {
      Bytes digested;
      std::uint64_t mask = 0;
      for (const auto& [other, other_hash] : tiles) {
        if (other >> 6 != key >> 6) {
          continue;
        }
        mask |= std::uint64_t{1} << (other & 63);
        for (const std::uint64_t value : {other, other_hash}) {
          for (int byte = 0; byte < 8; ++byte) {
            digested.push_back(static_cast<std::uint8_t>(value >> 8 * byte));
          }
        }
      }
      held.add_blocks(key >> 6);
      held.add_masks(mask);
      held.add_digests(Hash64(digested));
    }
  }
  SyncReply reply = Ask(*peer, request);
  EXPECT_TRUE(reply.tiles.empty());
  EXPECT_EQ(reply.holdings.not_modified(), tiles.size());
  EXPECT_EQ(reply.holdings.differing_blocks_size(), 0);
  held.set_digests(0, held.digests(0) + 1);
  reply = Ask(*peer, request);
  EXPECT_TRUE(reply.tiles.empty());
  ASSERT_EQ(reply.holdings.differing_blocks_size(), 1);
  EXPECT_EQ(reply.holdings.differing_blocks(0), held.blocks(0));
}

TEST_F(SyncTest, WhatARetractedSessionLeavesIsTold) {
  Serve();
  UploadDrive(4);
  Digest();
  const auto peer = Connect();
  const SyncReply whole = Ask(*peer, SyncOf(3));
  wire::Envelope retract;
  retract.set_request_id(5);
  retract.mutable_change_session()->set_vehicle("bus");
  retract.mutable_change_session()->set_session("day");
  retract.mutable_change_session()->set_action(wire::ChangeSession::RETRACT);
  peer->Send(retract);
  ASSERT_TRUE(peer->Receive()->has_change_session_reply());
  Digest();
  wire::Envelope again = SyncOf(6);
  Hold(whole.tiles, again);
  const SyncReply reply = Ask(*peer, again);
  EXPECT_TRUE(reply.tiles.empty());
  EXPECT_EQ(static_cast<std::size_t>(reply.holdings.removed_size()), whole.tiles.size());
}

TEST_F(SyncTest, SectionsAreSentOnceEach) {
  Serve();
  UploadDrive(4);
  Digest();
  const auto peer = Connect();
  const SyncReply whole = Ask(*peer, SyncOf(3));
  wire::Envelope surfaces = SyncOf(4);
  surfaces.mutable_sync_request()->add_sections(2);
  const SyncReply bare = Ask(*peer, surfaces);
  ASSERT_EQ(bare.tiles.size(), whole.tiles.size());
  EXPECT_LT(bare.bytes, whole.bytes);
  wire::Envelope rest = SyncOf(5);
  Hold(bare.tiles, rest);
  rest.mutable_sync_request()->mutable_held(0)->add_sections(2);
  const SyncReply others = Ask(*peer, rest);
  ASSERT_EQ(others.tiles.size(), whole.tiles.size());
  for (std::size_t i = 0; i < whole.tiles.size(); ++i) {
    const auto merged =
        MergeSections(BytesFromWire(bare.tiles[i].blob()), BytesFromWire(others.tiles[i].blob()));
    ASSERT_TRUE(merged.has_value()) << merged.error().message();
    EXPECT_EQ(BytesToWire(*merged), whole.tiles[i].blob());
  }
}

TEST_F(SyncTest, BadRequestsAreRefusedAndTheConnectionGoesOn) {
  Serve();
  UploadDrive(2);
  Digest();
  const auto peer = Connect();
  const auto refusal = [&](const std::function<void(wire::SyncRequest&)>& change) {
    wire::Envelope request = SyncOf(9);
    change(*request.mutable_sync_request());
    return Ask(*peer, request).refusal;
  };
  using Request = wire::SyncRequest;
  constexpr auto kWrong = StatusCode::kInvalidArgument;
  EXPECT_EQ(refusal([](Request&) {}), StatusCode::kOk);
  EXPECT_EQ(refusal([](Request& r) { r.clear_area(); }), kWrong);
  EXPECT_EQ(refusal([](Request& r) { r.mutable_area()->mutable_corridor(); }), kWrong);
  EXPECT_EQ(refusal([](Request& r) { r.mutable_area()->mutable_tiles()->add_keys(~0ull); }),
            kWrong);
  EXPECT_EQ(refusal([](Request& r) {
              r.add_held()->add_keys(~0ull);
              r.mutable_held(0)->add_payload_hashes(1);
            }),
            kWrong);
  EXPECT_EQ(refusal([](Request& r) { r.set_finest_level(99); }), kWrong);
  EXPECT_EQ(refusal([](Request& r) { r.add_sections(64); }), kWrong);
  EXPECT_EQ(refusal([](Request& r) { r.add_held()->add_keys(1); }), kWrong);
  EXPECT_EQ(refusal([](Request& r) { r.add_held()->add_blocks(1); }), kWrong);
  EXPECT_EQ(refusal([](Request& r) { r.set_cursor("no cursor"); }), kWrong);
  EXPECT_EQ(refusal([](Request& r) { r.set_wait_revision(1'000'000); }), kWrong);
  // A cursor of a reply to another request.
  wire::Envelope request = SyncOf(10);
  request.mutable_sync_request()->set_budget_bytes(5'000);
  const SyncReply part = Ask(*peer, request);
  ASSERT_FALSE(part.end.cursor().empty());
  // One of a revision to come.
  std::string later = part.end.cursor();
  later[6] = 1;
  request.mutable_sync_request()->set_cursor(later);
  EXPECT_EQ(Ask(*peer, request).refusal, kWrong);
  request.mutable_sync_request()->set_finest_level(1);
  request.mutable_sync_request()->set_cursor(part.end.cursor());
  EXPECT_EQ(Ask(*peer, request).refusal, kWrong);
}

TEST_F(SyncTest, WaitsForARevision) {
  Serve();
  const auto peer = Connect();
  peer->Send(UploadOf(0, 1));
  const auto uploaded = peer->Receive();
  wire::Envelope request = SyncOf(2);
  request.mutable_sync_request()->set_wait_revision(uploaded->upload_reply().revision());
  request.mutable_sync_request()->set_timeout_ms(60'000);
  EXPECT_FALSE(Ask(*peer, request).tiles.empty());
}

}  // namespace
}  // namespace atlas
