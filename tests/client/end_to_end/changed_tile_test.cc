// One tile of an area that a vehicle holds changes: what travels is that tile and what is above it.
#include <algorithm>
#include <span>

#include "client/connection/keyframe_uploader.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/client/end_to_end/reply_frames.h"
#include "tests/client/end_to_end/vehicle_fixture.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas {
namespace {

class ChangedTileTest : public VehicleTest {
 protected:
  // In the middle of a tile that the drive saw, far from the next.
  static QuantizedPose PoseIn(const TileId& id, const MapProfile& profile, double dx_m) {
    Pose T_world_sensor = Pose::Identity();
    T_world_sensor.translation() << profile.tile_size_m() * (id.x + 0.5) + dx_m,
        profile.tile_size_m() * (id.y + 0.5), 1.8;
    return QuantizedPose::FromPose(T_world_sensor);
  }

  // A keyframe that reaches 2 m.
  static Bytes SmallKeyframe(const MapProfile& profile) {
    return EncodeKeyframe(testing::StreetKeyframe(profile, 10, 7));
  }

  static std::vector<TileId> WithAncestors(TileId id, const MapProfile& profile) {
    std::vector<TileId> chain = {id};
    while (chain.back().level + 1 < profile.levels) {
      chain.push_back(chain.back().Parent());
    }
    return chain;
  }

  // What comes over the wire until the store is up to date.
  static ReplyFrames SyncRecorded(const DaemonProcess& daemon, TileStore& store) {
    LinkProxy proxy(*Endpoint::Parse(daemon.address()), {.is_recorded = true});
    {
      AtlasClient client = Connect(proxy.endpoint());
      const auto report = SyncStore(client, store, Everywhere());
      EXPECT_TRUE(report && report->is_complete);
    }
    ReplyFrames frames = TakeApart(proxy.Passed());
    std::sort(frames.tiles.begin(), frames.tiles.end());
    std::sort(frames.announced.begin(), frames.announced.end());
    return frames;
  }
};

TEST_F(ChangedTileTest, ExactlyItAndItsAncestorsTravel) {
  DaemonProcess daemon(NewData(), kSmall);
  Fill(daemon);
  AtlasClient client = Connect(daemon);
  const MapProfile profile = client.profile();
  TileStore store = StoreFor(client);
  ASSERT_TRUE(SyncStore(client, store, Everywhere()));
  const auto held = store.Tiles();
  const TileId id =
      *std::find_if(held.begin(), held.end(), [](const TileId& tile) { return tile.level == 0; });

  const Bytes blob = SmallKeyframe(profile);
  const KeyframeKey key{{"car", "visit"}, 0};
  KeyframeUploader uploader(client);
  ASSERT_TRUE(uploader.Upload({key, 1'000, PoseIn(id, profile, 0.0), blob}).ok());
  ASSERT_TRUE(uploader.Finish().ok());
  ASSERT_EQ(uploader.totals().tiles_marked, 1U);
  ASSERT_TRUE(client.WaitUntilFused(std::chrono::seconds(60)));
  const auto expected = WithAncestors(id, profile);
  const ReplyFrames visit = SyncRecorded(daemon, store);
  EXPECT_EQ(visit.tiles, expected);
  EXPECT_EQ(visit.announced, expected);
  EXPECT_EQ(visit.removed, 0U);
  EXPECT_EQ(Held(store), AtlasNow(client));

  const HashById before = AtlasNow(client);
  const PoseCorrection moved{key, PoseIn(id, profile, 1.0)};
  ASSERT_TRUE(client.UpdatePoses(std::span(&moved, 1), "test"));
  ASSERT_TRUE(client.WaitUntilFused(std::chrono::seconds(60)));
  std::vector<TileId> changed;  // of the ancestors some may be what they were
  for (const auto& [tile, hash] : AtlasNow(client)) {
    if (before.at(tile) != hash) changed.push_back(tile);
  }
  ASSERT_FALSE(changed.empty());
  EXPECT_EQ(changed.front(), id);
  EXPECT_TRUE(std::includes(expected.begin(), expected.end(), changed.begin(), changed.end()));
  const ReplyFrames correction = SyncRecorded(daemon, store);
  EXPECT_EQ(correction.tiles, changed);
  EXPECT_EQ(correction.announced, changed);
  EXPECT_EQ(Held(store), AtlasNow(client));

  EXPECT_TRUE(SyncRecorded(daemon, store).announced.empty());
}

}  // namespace
}  // namespace atlas
