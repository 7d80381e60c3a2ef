// A sync against daemons that keep their word, that do not, and that are too old.
#include <gtest/gtest.h>

#include "client/connection/atlas_client.h"
#include "proto/wire/convert.h"
#include "tests/client/support/test_peer.h"

namespace atlas {
namespace {

constexpr TileId kCoarse{3, 0, 0};
constexpr TileId kFine{0, 1, 0};

// What a daemon of this minor version says to one sync, after the handshake.
class Script {
 public:
  explicit Script(std::uint32_t minor = 4) : minor_(minor) {}

  Script& Manifest(const std::vector<TileId>& ids) {
    wire::SyncManifest& manifest = *Add().mutable_sync_manifest();
    for (const TileId& id : ids) {
      manifest.add_keys(id.Key());
      manifest.add_revisions(5);
      manifest.add_payload_hashes(77);
      manifest.add_bytes(4);
    }
    return *this;
  }
  Script& Tile(const TileId& id,
               std::uint64_t payload_hash = 77,
               const std::string& blob = "blob",
               std::uint64_t base_hash = 0) {
    wire::TileMessage& tile = *Add().mutable_tile();
    tile.set_key(id.Key());
    tile.set_revision(5);
    tile.set_payload_hash(payload_hash);
    tile.set_blob(blob);
    tile.set_base_hash(base_hash);
    ++tiles_;
    return *this;
  }
  Script& End(std::uint32_t more_tiles = 0, std::uint64_t more_bytes = 0) {
    wire::SyncEnd& end = *Add().mutable_sync_end();
    end.set_tiles(tiles_ + more_tiles);
    end.set_revision(9);
    end.set_cursor("on");
    end.set_bytes(1);  // holds the place
    std::uint64_t bytes = more_bytes;
    for (wire::Envelope frame : frames_) {
      frame.set_request_id(2);
      bytes += EncodeEnvelopeFrame(frame)->size();
    }
    end.set_bytes(bytes);
    // A larger number may take a byte more.
    bytes += VarintBytes(bytes) - 1;
    end.set_bytes(bytes);
    return *this;
  }
  wire::SyncManifest& first() { return *frames_.front().mutable_sync_manifest(); }

  void Serve(PeerSocket& socket) const {
    wire::Envelope hello;
    hello.mutable_hello_reply()->set_protocol_major(kProtocolMajor);
    hello.mutable_hello_reply()->set_protocol_minor(minor_);
    hello.mutable_hello_reply()->set_profile(ProfileToWire({}));
    socket.Reply(socket.ReadRequest()->request_id(), std::move(hello));
    const auto request = socket.ReadRequest();
    if (!request) return;
    for (const wire::Envelope& frame : frames_) {
      socket.Reply(request->request_id(), frame);
    }
    socket.Drain();
  }

 private:
  static std::uint64_t VarintBytes(std::uint64_t value) {
    return value < 128 ? 1 : value < 16384 ? 2 : 3;
  }
  wire::Envelope& Add() { return frames_.emplace_back(); }

  std::uint32_t minor_;
  std::uint32_t tiles_ = 0;
  std::vector<wire::Envelope> frames_;
};

struct Outcome {
  Result<SyncSummary> summary = Error(StatusCode::kInternal, "not asked");
  std::vector<TileId> tiles;
  StatusCode code() const { return summary ? StatusCode::kOk : summary.error().code(); }
};

SyncQuery Everything() {
  SyncQuery query;
  query.area = DiscArea{{0.0, 0.0}, 1e5};
  return query;
}

Outcome Ask(const Script& script, const SyncQuery& query = Everything()) {
  TestPeer peer([&](PeerSocket& socket) { script.Serve(socket); });
  auto client = AtlasClient::Connect(peer.options());
  Outcome outcome;
  if (!client) return outcome;
  outcome.summary = client->Sync(query, [&](const TileBlob& tile) {
    outcome.tiles.push_back(tile.id);
    return Status();
  });
  return outcome;
}

TEST(SyncTest, TilesComeInOrderAndAreCounted) {
  const Outcome outcome =
      Ask(Script().Manifest({kCoarse}).Tile(kCoarse).Manifest({kFine}).Tile(kFine).End());
  ASSERT_TRUE(outcome.summary) << outcome.summary.error().message();
  EXPECT_EQ(outcome.tiles, (std::vector{kCoarse, kFine}));
  EXPECT_EQ(outcome.summary->tiles, 2U);
  EXPECT_EQ(outcome.summary->revision, 9U);
  EXPECT_EQ(outcome.summary->cursor, (Bytes{'o', 'n'}));
}

TEST(SyncTest, WhatBecameOfHeldTilesIsTold) {
  SyncQuery query = Everything();
  query.held = {{kEverySection, {{kFine, 1}, {kCoarse, 2}}, {{5, 3, 4}}}};
  Script script;
  script.Manifest({});
  script.first().set_current_tiles("\x02");
  script.first().set_not_modified(1);
  script.first().add_removed(kFine.Key());
  script.first().add_differing_blocks(5);
  const Outcome outcome = Ask(script.End(), query);
  ASSERT_TRUE(outcome.summary) << outcome.summary.error().message();
  EXPECT_EQ(outcome.summary->current_tiles, (std::vector{false, true}));
  EXPECT_EQ(outcome.summary->current_blocks, (std::vector{false}));
  EXPECT_EQ(outcome.summary->not_modified_tiles, 1U);
  EXPECT_EQ(outcome.summary->removed, (std::vector{kFine}));
  EXPECT_EQ(outcome.summary->differing_blocks, (std::vector<std::uint64_t>{5}));
}

TEST(SyncTest, ADaemonThatBreaksItsWordIsInvalidData) {
  const std::vector<Script> liars = {
      Script().Manifest({kCoarse, kFine}).Tile(kFine).Tile(kCoarse).End(),
      Script().Manifest({kCoarse}).Tile(kCoarse, 78).End(),
      Script().Manifest({kCoarse}).Tile(kCoarse, 77, "blobs").End(),
      Script().Manifest({kCoarse}).End(),
      Script().Manifest({kCoarse}).Manifest({}).End(),
      Script().Manifest({}).Tile(kCoarse).End(),
      Script().Tile(kCoarse).End(),
      Script().End(),
      Script().Manifest({kCoarse}).Tile(kCoarse).End(1),
      Script().Manifest({kCoarse}).Tile(kCoarse).End(0, 1),
  };
  for (std::size_t i = 0; i < liars.size(); ++i) {
    EXPECT_EQ(Ask(liars[i]).code(), StatusCode::kInvalidData) << i;
  }
}

TEST(SyncTest, WordsAboutTilesThatAreNotHeldAreInvalidData) {
  Script current;
  current.Manifest({}).first().set_current_tiles("\x01");
  Script removed;
  removed.Manifest({}).first().add_removed(kFine.Key());
  Script differing;
  differing.Manifest({}).first().add_differing_blocks(5);
  for (Script* script : {&current, &removed, &differing}) {
    EXPECT_EQ(Ask(script->End()).code(), StatusCode::kInvalidData);
  }
}

TEST(SyncTest, DeltasAreTakenToHeldTilesOnlyAndWhereTheyWereAskedFor) {
  Script script;
  script.Manifest({kFine}).Tile(kFine, 77, "blob", 55).End();
  SyncQuery query = Everything();
  query.held = {{kEverySection, {{kFine, 55}}, {}}};
  EXPECT_EQ(Ask(script, query).code(), StatusCode::kInvalidData) << "not asked for";
  query.takes_deltas = true;
  const Outcome outcome = Ask(script, query);
  ASSERT_TRUE(outcome.summary) << outcome.summary.error().message();
  EXPECT_EQ(outcome.summary->deltas, 1U);
  query.held[0].tiles[0].payload_hash = 56;
  EXPECT_EQ(Ask(script, query).code(), StatusCode::kInvalidData) << "another content is held";
}

TEST(SyncTest, TilesOfOtherLevelsAndMoreThanTheBudgetAreInvalidData) {
  SyncQuery query = Everything();
  query.finest_level = 1;
  EXPECT_EQ(Ask(Script().Manifest({kFine}).Tile(kFine).End(), query).code(),
            StatusCode::kInvalidData);
  query = Everything();
  query.budget_bytes = 100;
  EXPECT_EQ(
      Ask(Script().Manifest({kFine}).Tile(kFine, 77, std::string(4, 'x')).End(), query).code(),
      StatusCode::kInvalidData);
}

TEST(SyncTest, AnOldDaemonIsNotAsked) {
  EXPECT_EQ(Ask(Script(3)).code(), StatusCode::kUnsupported);
}

TEST(SyncTest, AreasThatAreNoneAreNotAskedFor) {
  for (const MapArea& area : std::initializer_list<MapArea>{
           DiscArea{{NAN, 0.0}, 1.0}, DiscArea{{0.0, 0.0}, -1.0}, BoxArea{{1.0, 0.0}, {0.0, 1.0}},
           CorridorArea{{}, 1.0}, TilesArea{{kFine, kFine}}}) {
    SyncQuery query;
    query.area = area;
    EXPECT_EQ(Ask(Script(), query).code(), StatusCode::kInvalidArgument);
  }
}

TEST(SyncTest, CutInTheMiddleWhatCameIsHandedOver) {
  TestPeer peer([](PeerSocket& socket) {
    wire::Envelope hello;
    hello.mutable_hello_reply()->set_protocol_major(kProtocolMajor);
    hello.mutable_hello_reply()->set_protocol_minor(4);
    hello.mutable_hello_reply()->set_profile(ProfileToWire({}));
    socket.Reply(socket.ReadRequest()->request_id(), std::move(hello));
    const auto request = socket.ReadRequest();
    wire::Envelope manifest;
    wire::SyncManifest& announced = *manifest.mutable_sync_manifest();
    announced.add_keys(kCoarse.Key());
    announced.add_revisions(1);
    announced.add_payload_hashes(1);
    announced.add_bytes(0);
    socket.Reply(request->request_id(), std::move(manifest));
    wire::Envelope tile;
    tile.mutable_tile()->set_key(kCoarse.Key());
    tile.mutable_tile()->set_revision(1);
    tile.mutable_tile()->set_payload_hash(1);
    socket.Reply(request->request_id(), std::move(tile));
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  int tiles = 0;
  const auto summary = client->Sync(Everything(), [&](const TileBlob&) {
    ++tiles;
    return Status();
  });
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code(), StatusCode::kUnavailable);
  EXPECT_EQ(tiles, 1);
}

}  // namespace
}  // namespace atlas
