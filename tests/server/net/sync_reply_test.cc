#include "server/net/requests/sync_reply.h"

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include "core/tile/tile_delta.h"
#include "proto/wire/convert.h"
#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

class SyncReplyTest : public ServiceTest {
 protected:
  void SetUp() override {
    Open();
    UploadDrive(6);
    Digest();
  }

  SyncReply ReplyTo(std::uint64_t budget_bytes = 0) {
    wire::Envelope envelope;
    envelope.set_request_id(9);
    auto& disc = *envelope.mutable_sync_request()->mutable_area()->mutable_disc();
    disc.set_radius_um(100'000'000);
    envelope.mutable_sync_request()->set_budget_bytes(budget_bytes);
    return {*service_, frames_, Request{std::make_shared<wire::Envelope>(envelope)}};
  }
  static Bytes BytesOf(const std::vector<ReplyFrame>& frames) {
    ByteWriter out;
    for (const ReplyFrame& frame : frames) {
      out.Raw(frame.head());
      if (frame.tile()) {
        out.Raw(frame.tile()->bytes());
      }
      out.Raw(frame.tail());
      EXPECT_EQ(frame.size(), frame.head().size() + frame.tail().size() +
                                  (frame.tile() ? frame.tile()->bytes().size() : 0));
    }
    return out.Take();
  }
  // All of it.
  Bytes Run(SyncReply& reply, bool may_block) {
    std::vector<ReplyFrame> frames;
    while (true) {
      const auto step = reply.Next(may_block, frames);
      EXPECT_TRUE(step.has_value());
      EXPECT_NE(*step, SyncReply::Step::kBlocked);
      if (!step || *step != SyncReply::Step::kMore) {
        return BytesOf(frames);
      }
    }
  }

  TileFrames frames_{1u << 20};
};

TEST_F(SyncReplyTest, DoesNothingWithoutTheDiskThatItNeeds) {
  SyncReply reply = ReplyTo();
  std::vector<ReplyFrame> frames;
  const auto step = reply.Next(false, frames);
  ASSERT_TRUE(step.has_value());
  EXPECT_EQ(*step, SyncReply::Step::kBlocked);
  EXPECT_TRUE(frames.empty());
  EXPECT_FALSE(Run(reply, true).empty()) << "and may be asked again";
}

TEST_F(SyncReplyTest, FromMemoryIsTheSameBytes) {
  SyncReply first = ReplyTo();
  const Bytes bytes = Run(first, true);
  EXPECT_GT(bytes.size(), 1'000u);
  SyncReply second = ReplyTo();
  EXPECT_EQ(Run(second, false), bytes);
}

// All of it is in memory, but each tile is compared with each leg.
TEST_F(SyncReplyTest, ALongWayIsNotPlannedWithoutThePool) {
  SyncReply disc = ReplyTo();
  Run(disc, true);
  wire::Envelope envelope;
  envelope.set_request_id(9);
  auto& corridor = *envelope.mutable_sync_request()->mutable_area()->mutable_corridor();
  for (int i = 0; i < 256; ++i) {
    auto& point = *corridor.add_route();
    point.set_x_um(i % 2 * 25'000'000);
    point.set_y_um(i * 100'000);
  }
  SyncReply reply(*service_, frames_, Request{std::make_shared<wire::Envelope>(envelope)});
  std::vector<ReplyFrame> frames;
  for (int i = 0; i < 2; ++i) {
    const auto step = reply.Next(false, frames);
    ASSERT_TRUE(step.has_value());
    EXPECT_EQ(*step, SyncReply::Step::kBlocked);
    EXPECT_TRUE(frames.empty());
  }
  EXPECT_FALSE(Run(reply, true).empty());
}

TEST_F(SyncReplyTest, GoesOnWhereMemoryEnds) {
  SyncReply whole = ReplyTo();
  const Bytes expected = Run(whole, true);
  // Room for a few tiles only: each step finds some in memory and needs the disk for others.
  TileFrames few(8u << 10);
  wire::Envelope envelope;
  envelope.set_request_id(9);
  envelope.mutable_sync_request()->mutable_area()->mutable_disc()->set_radius_um(100'000'000);
  SyncReply reply(*service_, few, Request{std::make_shared<wire::Envelope>(envelope)});
  std::uint64_t tiles = 0;
  std::uint64_t ends = 0;
  std::vector<ReplyFrame> frames;
  for (bool may_block = false; ends == 0; may_block = !may_block) {
    frames.clear();
    const auto step = reply.Next(may_block, frames);
    ASSERT_TRUE(step.has_value());
    EXPECT_FALSE(may_block && *step == SyncReply::Step::kBlocked);
    for (const ReplyFrame& frame : frames) {
      tiles += frame.tile() ? 1u : 0u;
    }
    ends += *step == SyncReply::Step::kDone ? 1u : 0u;
  }
  EXPECT_EQ(tiles, static_cast<std::uint64_t>(service_->ReadStatus()->counts.tiles));
}

// As when many others read slowly.
TEST_F(SyncReplyTest, WithLittleRoomItPlansAFewTilesAtATime) {
  for (std::uint32_t i = 0; i < 48; ++i) {
    UploadRequest upload = DriveUpload(i, "far-" + std::to_string(i));
    upload.pose = PoseOf({100.0 + 20.0 * i, 0.0, 1.8, 0.0});
    ASSERT_TRUE(Upload(std::move(upload)));
  }
  Digest();
  const std::uint64_t expected = service_->ReadStatus()->counts.tiles;
  ASSERT_GT(expected, 300u);
  wire::Envelope envelope;
  envelope.mutable_sync_request()->mutable_area()->mutable_disc()->set_radius_um(10'000'000'000);
  SyncReply reply(*service_, frames_, Request{std::make_shared<wire::Envelope>(envelope)});
  std::map<std::uint64_t, int> tiles;
  std::size_t most_bytes = 0;
  Result<SyncReply::Step> step = SyncReply::Step::kMore;
  while (step && *step == SyncReply::Step::kMore) {
    std::vector<ReplyFrame> frames;
    step = reply.Next(true, frames, {1, 0});
    most_bytes = std::max(most_bytes, reply.kept_bytes());
    for (const ReplyFrame& frame : frames) {
      if (frame.tile()) {
        ++tiles[frame.tile()->id().key];
      }
    }
  }
  EXPECT_EQ(step.value(), SyncReply::Step::kDone);
  EXPECT_EQ(tiles.size(), expected);
  EXPECT_LE(most_bytes, 256 * sizeof(SyncItem));
}

// Tiles by key, of which contents.
class SyncDeltaTest : public SyncReplyTest {
 protected:
  using Tiles = std::map<std::uint64_t, std::shared_ptr<const TileBody>>;

  // What comes to who holds these, by their keys.
  Tiles Sync(TileFrames& frames, const Tiles& held, bool takes_deltas, bool may_block = true) {
    wire::Envelope envelope;
    envelope.set_request_id(9);
    wire::SyncRequest& request = *envelope.mutable_sync_request();
    request.mutable_area()->mutable_disc()->set_radius_um(100'000'000);
    request.set_takes_deltas(takes_deltas);
    wire::Held& group = *request.add_held();
    for (const auto& [key, tile] : held) {
      group.add_keys(key);
      group.add_payload_hashes(tile->id().payload_hash);
    }
    SyncReply reply(*service_, frames, Request{std::make_shared<wire::Envelope>(envelope)});
    std::vector<ReplyFrame> out;
    Result<SyncReply::Step> step = SyncReply::Step::kMore;
    while (step && *step == SyncReply::Step::kMore) {
      step = reply.Next(may_block, out);
    }
    EXPECT_EQ(step.value(), SyncReply::Step::kDone);
    Tiles tiles;
    for (const ReplyFrame& frame : out) {
      if (frame.tile()) {
        tiles[frame.tile()->id().key] = frame.tile();
      }
    }
    return tiles;
  }
  void Change() {
    ASSERT_TRUE(Upload(DriveUpload(7)));
    Digest();
  }
  static Bytes Copy(ByteSpan bytes) { return {bytes.begin(), bytes.end()}; }
};

TEST_F(SyncDeltaTest, WhatChangedComesAsTheDifference) {
  const Tiles before = Sync(frames_, {}, true);
  for (const auto& [key, tile] : before) {
    EXPECT_EQ(tile->id().base_hash, 0u) << "nothing is held";
  }
  Change();
  TileFrames others(1u << 20);
  const Tiles whole = Sync(others, before, false);
  const Tiles deltas = Sync(frames_, before, true);
  ASSERT_EQ(deltas.size(), whole.size());
  std::size_t count = 0;
  for (const auto& [key, tile] : deltas) {
    const Bytes expected = Copy(whole.at(key)->blob());
    if (tile->id().base_hash == 0) {
      EXPECT_EQ(Copy(tile->blob()), expected);
      continue;
    }
    ++count;
    EXPECT_EQ(tile->id().base_hash, before.at(key)->id().payload_hash);
    EXPECT_EQ(tile->id().payload_hash, whole.at(key)->id().payload_hash);
    EXPECT_LT(tile->blob().size(), expected.size());
    EXPECT_EQ(ApplyTileDelta(before.at(key)->blob(), tile->blob()).value(), expected);
  }
  EXPECT_GT(count, 0u);
  // Of the next one who holds the same: from memory, without another thread.
  const Tiles again = Sync(frames_, before, true, false);
  EXPECT_EQ(again, deltas);
}

TEST_F(SyncDeltaTest, WholeTilesComeWhereTheBaseIsNotThereOrNotWanted) {
  const Tiles before = Sync(frames_, {}, true);
  Change();
  TileFrames others(1u << 20);  // as after a restart
  for (const Tiles& tiles : {Sync(others, before, true), Sync(frames_, before, false)}) {
    EXPECT_FALSE(tiles.empty());
    for (const auto& [key, tile] : tiles) {
      EXPECT_EQ(tile->id().base_hash, 0u);
    }
  }
}

}  // namespace
}  // namespace atlas
