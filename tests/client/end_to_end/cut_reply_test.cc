// The daemon's replies to a sync, cut after every frame: what is held then is a map, nothing that
// was held is lost or damaged, and the next sync brings the rest, no tile twice.
#include <algorithm>
#include <span>

#include "tests/client/end_to_end/reply_frames.h"
#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

class CutReplyTest : public VehicleTest {
 protected:
  void SetUp() override {
    daemon_.emplace(NewData(), kSmall);
    Fill(*daemon_);
    client_.emplace(Connect(*daemon_));
    TileStore store = StoreFor(*client_);
    ASSERT_TRUE(SyncStore(*client_, store, Everywhere()));  // the daemon has all in memory now
    atlas_ = AtlasNow(*client_);
    ASSERT_GT(atlas_.size(), 20U);
  }

  Endpoint daemon() const { return *Endpoint::Parse(daemon_->address()); }
  TileStore EmptyStore() const { return StoreFor(*client_); }
  // Of a store in `folder`, to be changed.
  TileStore CopyOf(const fs::path& folder) const {
    const fs::path copy = folder.string() + ".copy";
    fs::remove_all(copy);
    fs::copy(folder, copy, fs::copy_options::recursive);
    return StoreFor(*client_, copy);
  }

  // What the daemon sends to somebody who syncs this store.
  ReplyFrames Record(TileStore store, const SyncQuery& query) const {
    LinkProxy proxy(daemon(), {.is_recorded = true});
    {
      AtlasClient client = Connect(proxy.endpoint());
      EXPECT_TRUE(SyncStore(client, store, query));
    }
    return TakeApart(proxy.Passed());
  }

  Result<StoreSyncReport> SyncCut(TileStore& store,
                                  const SyncQuery& query,
                                  std::int64_t bytes,
                                  LinkCut::Kind kind = LinkCut::Kind::kClose) const {
    LinkProxy proxy(daemon(), CutAfter(bytes, kind));
    AtlasClient client = Connect(proxy.endpoint());
    return SyncStore(client, store, query);
  }

  // Every place of the atlas below a tile of the coarsest level that came is in the view; whatever
  // is held decodes, and has what is coarser above it.
  void ExpectIsMap(TileStore& store) const {
    const auto coarsest = static_cast<std::uint8_t>(client_->profile().levels - 1);
    const auto map = AtlasView(store, nullptr).Around({0.0, 0.0}, 1e6);
    ASSERT_TRUE(map) << map.error().message();
    std::map<TileId, bool> is_shown;
    for (const auto& tile : map->tiles) {
      is_shown[tile->id] = true;
    }
    for (const auto& [id, hash] : atlas_) {
      if (id.level != 0) continue;
      bool is_covered = false;
      TileId place = id;
      for (; place.level < coarsest; place = place.Parent()) {
        is_covered |= is_shown.contains(place);
      }
      is_covered |= is_shown.contains(place);
      EXPECT_EQ(is_covered, store.Find(place) != nullptr) << id;
    }
    for (const TileId& id : store.Tiles()) {
      EXPECT_TRUE(store.Read(id)) << id;
      EXPECT_TRUE(id.level == coarsest || store.Find(id.Parent()) != nullptr) << id;
    }
  }

  // How many of the atlas's tiles are not held as they are now.
  std::size_t Missing(const TileStore& store) const {
    return static_cast<std::size_t>(
        std::count_if(atlas_.begin(), atlas_.end(), [&](const auto& tile) {
          const TileFacts* held = store.Find(tile.first);
          return held == nullptr || held->payload_hash != tile.second;
        }));
  }

  void ExpectNextSyncCompletes(TileStore& store) {
    const std::size_t missing = Missing(store);
    const auto rest = SyncStore(*client_, store, Everywhere());
    ASSERT_TRUE(rest) << rest.error().message();
    EXPECT_TRUE(rest->is_complete);
    EXPECT_EQ(rest->tiles, missing);
    EXPECT_EQ(Held(store), atlas_);
  }

  std::optional<DaemonProcess> daemon_;
  std::optional<AtlasClient> client_;
  HashById atlas_;
};

TEST_F(CutReplyTest, EveryPrefixOfAColdReplyIsAMap) {
  const ReplyFrames frames = Record(EmptyStore(), Everywhere());
  ASSERT_EQ(frames.tiles.size(), atlas_.size());
  ASSERT_TRUE(std::is_sorted(frames.tiles.begin(), frames.tiles.end(),
                             [levels = client_->profile().levels](const auto& a, const auto& b) {
                               return (a.level + 1 == levels) > (b.level + 1 == levels);
                             }))
      << "the coarsest ones come first";
  for (std::size_t i = 0; i < frames.ends.size(); ++i) {
    SCOPED_TRACE(i);
    TileStore store = EmptyStore();
    const auto report = SyncCut(store, Everywhere(), frames.ends[i]);
    EXPECT_EQ(report.has_value(), i + 1 == frames.ends.size());
    EXPECT_EQ(Held(store).size(), frames.arrived[i]);
    ExpectIsMap(store);
    ExpectNextSyncCompletes(store);
  }
}

TEST_F(CutReplyTest, AResetInTheMiddleOfAFrameLosesThatFrame) {
  const ReplyFrames frames = Record(EmptyStore(), Everywhere());
  for (std::size_t i = 1; i < frames.ends.size(); ++i) {
    SCOPED_TRACE(i);
    TileStore store = EmptyStore();
    const std::int64_t middle = (frames.ends[i - 1] + frames.ends[i]) / 2;
    EXPECT_FALSE(SyncCut(store, Everywhere(), middle, LinkCut::Kind::kReset));
    EXPECT_LE(store.size(), frames.arrived[i - 1]);
    ExpectIsMap(store);
    ExpectNextSyncCompletes(store);
  }
}

TEST_F(CutReplyTest, AWarmStoreKeepsItsMapWhileTilesChangeAndGo) {
  const fs::path folder = shared_root / "warm";
  TileStore warm = StoreFor(*client_, folder);
  ASSERT_TRUE(SyncStore(*client_, warm, Everywhere()));
  const HashById before = atlas_;
  ASSERT_TRUE(client_->ChangeSession({"vehicle", "overpass.2"}, SessionAction::kRetract, "test"));
  ASSERT_TRUE(client_->WaitUntilFused(std::chrono::seconds(60)));
  atlas_ = AtlasNow(*client_);
  static_cast<void>(Record(CopyOf(folder), Everywhere()));  // in memory, too
  const ReplyFrames frames = Record(CopyOf(folder), Everywhere());
  EXPECT_GT(frames.removed, 0U);
  EXPECT_GT(frames.differing, 0U);
  EXPECT_EQ(frames.tiles.size(), Missing(warm));
  for (std::size_t i = 0; i < frames.ends.size(); ++i) {
    SCOPED_TRACE(i);
    TileStore store = CopyOf(folder);
    static_cast<void>(SyncCut(store, Everywhere(), frames.ends[i]));
    for (const auto& [id, hash] : Held(store)) {
      const bool is_old = before.contains(id) && before.at(id) == hash;
      EXPECT_TRUE(is_old || (atlas_.contains(id) && atlas_.at(id) == hash)) << id;
    }
    ExpectIsMap(store);
    ExpectNextSyncCompletes(store);
  }
}

TEST_F(CutReplyTest, RepliesWithABudgetAreCutAndGoOnAllTheSame) {
  SyncQuery query = Everywhere();
  query.budget_bytes = 60'000;
  const ReplyFrames frames = Record(EmptyStore(), query);
  ASSERT_LT(frames.tiles.size(), atlas_.size());
  for (std::size_t i = 0; i < frames.ends.size(); ++i) {
    SCOPED_TRACE(i);
    TileStore store = EmptyStore();
    static_cast<void>(SyncCut(store, query, frames.ends[i]));
    EXPECT_EQ(store.size(), frames.arrived[i]);
    ExpectIsMap(store);
    std::uint64_t tiles = store.size();
    for (bool is_complete = false; !is_complete;) {
      const auto part = SyncStore(*client_, store, query);
      ASSERT_TRUE(part) << part.error().message();
      ASSERT_LE(part->bytes, query.budget_bytes);
      ASSERT_TRUE(part->is_complete || part->tiles > 0);
      tiles += part->tiles;
      is_complete = part->is_complete;
    }
    EXPECT_EQ(tiles, atlas_.size());
    EXPECT_EQ(Held(store), atlas_);
  }
}

}  // namespace
}  // namespace atlas
