// Tiles whose files cannot be read now: they stay, are missing meanwhile, and are there again.
#include <filesystem>

#include <gtest/gtest.h>

#include "client/vehicle/atlas_view.h"
#include "client/vehicle/store_sync.h"
#include "core/tile/tile_delta.h"
#include "tests/client/vehicle/sync_peer.h"
#include "tests/client/vehicle/test_folder.h"
#include "tests/core/support/no_descriptors.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr SectionBits kSurface = 1U << 1U | 1U << 2U;
constexpr double kSide_m = 1.6;  // of a level-0 tile
const Eigen::Vector2d kMiddle(2 * kSide_m, 2 * kSide_m);

class UnreadTilesTest : public testing::Test {
 protected:
  UnreadTilesTest() {
    for (int x = 0; x < 4; ++x) {
      for (int y = 0; y < 4; ++y) {
        world_.Set(x, y, 100 * x + y);
      }
    }
  }

  static SyncQuery Everywhere(SectionBits sections = kEverySection) {
    SyncQuery query;
    query.area = DiscArea{{0.0, 0.0}, 1e5};
    query.sections = sections;
    return query;
  }
  TileStore Open() const { return *TileStore::Open(TinyAtlas(), {.folder = folder_.path()}); }
  // A store that has all of the world on disk and nothing of it in memory.
  TileStore OpenFilled(SectionBits sections = kEverySection) const {
    {
      TileStore store = Open();
      SyncPeer peer(world_);
      auto client = AtlasClient::Connect(peer.options());
      EXPECT_TRUE(client && SyncStore(*client, store, Everywhere(sections)));
    }
    TileStore store = Open();
    EXPECT_EQ(store.size(), world_.tiles().size());
    EXPECT_EQ(store.memory_bytes(), 0U);
    return store;
  }
  std::size_t Files() const {
    std::size_t files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      files += entry.path().extension() == ".tile" ? 1U : 0U;
    }
    return files;
  }
  // A link to itself, which cannot be opened (ELOOP), also not by root.
  void MakeUnreadable(const TileId& id) const {
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      if (!fs::is_regular_file(entry.symlink_status())) continue;
      if (!entry.path().filename().string().starts_with(NameOf(id))) continue;
      const fs::path path = entry.path();
      fs::remove(path);
      fs::create_symlink(path.filename(), path);
      return;
    }
    FAIL() << "no file of " << id;
  }
  static std::string NameOf(const TileId& id) {
    std::string digits(16, '0');
    for (std::size_t i = 0; i < digits.size(); ++i) {
      digits[15 - i] = "0123456789abcdef"[id.Key() >> (4 * i) & 15U];
    }
    return digits + "-";
  }
  void ExpectHolds(TileStore& store) const {
    EXPECT_EQ(store.size(), world_.tiles().size());
    for (const auto& [id, stored] : world_.tiles()) {
      const auto blob = store.Read(id);
      ASSERT_TRUE(blob) << blob.error().message();
      EXPECT_EQ(**blob, stored.encoded.blob) << id;
    }
  }

  TestFolder folder_;
  TinyWorld world_;
};

TEST_F(UnreadTilesTest, WithoutDescriptorsTheyStay) {
  TileStore store = OpenFilled();
  {
    const NoDescriptors none;
    for (const auto& [id, stored] : world_.tiles()) {
      EXPECT_EQ(store.Read(id).error().code(), StatusCode::kResourceExhausted) << id;
      EXPECT_FALSE(store.ComesWhole(id));
    }
  }
  EXPECT_EQ(Files(), world_.tiles().size());
  ExpectHolds(store);
}

TEST_F(UnreadTilesTest, OpeningWithoutDescriptorsLeavesThem) {
  (void)OpenFilled();
  {
    const NoDescriptors none;
    const TileStore store = Open();
    EXPECT_EQ(store.disk_problem().code(), StatusCode::kResourceExhausted);
    EXPECT_EQ(store.size(), 0U);
  }
  TileStore again = Open();
  EXPECT_TRUE(again.disk_problem().ok()) << again.disk_problem().message();
  ExpectHolds(again);
}

TEST_F(UnreadTilesTest, AViewIsCoarseMeanwhileAndFetchesNothingAgain) {
  TileStore store = OpenFilled();
  SyncPeer peer(world_);
  LinkOptions options;
  options.connection = peer.options();
  AtlasLink link(options);
  ASSERT_TRUE(link.Wait(std::chrono::seconds(5)));
  AtlasView view(store, &link);
  ASSERT_TRUE(store.Read({1, 0, 0}));
  for (int call = 0; call < 3; ++call) {
    const NoDescriptors none;
    const auto map = view.Around({0.5 * kSide_m, 0.5 * kSide_m}, 0.1);
    ASSERT_TRUE(map) << map.error().message();
    EXPECT_TRUE(map->sync.ok()) << map->sync.message();
    EXPECT_EQ(map->disk.code(), StatusCode::kResourceExhausted);
    EXPECT_FALSE(map->is_current);
    EXPECT_FALSE(map->is_finest_everywhere());
    EXPECT_EQ(map->coarse_places, 1U);
    ASSERT_EQ(map->tiles.size(), 1U);
    EXPECT_EQ(map->tiles[0]->id, (TileId{1, 0, 0}));
  }
  const auto map = view.Around({0.5 * kSide_m, 0.5 * kSide_m}, 0.1);
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_TRUE(map->disk.ok()) << map->disk.message();
  EXPECT_TRUE(map->is_current);
  EXPECT_TRUE(map->is_finest_everywhere());
  EXPECT_EQ(peer.tiles_sent(), 0);
}

TEST_F(UnreadTilesTest, WhereABaseCannotBeReadTheWholeTileComes) {
  TileStore store = OpenFilled();
  const std::uint64_t before = world_.revision();
  world_.Set(1, 1, 5'000);
  std::uint64_t changed = 0;
  for (const auto& [id, stored] : world_.tiles()) {
    changed += stored.revision > before ? 1U : 0U;
  }
  SyncPeer peer(world_);
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client) << client.error().message();
  {
    const NoDescriptors none;
    const auto report = SyncStore(*client, store, Everywhere());
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_TRUE(report->is_complete);
    EXPECT_EQ(report->deltas, changed);
    EXPECT_EQ(report->tiles, 2 * changed);
    const auto again = SyncStore(*client, store, Everywhere());
    ASSERT_TRUE(again) << again.error().message();
    EXPECT_EQ(again->tiles, 0U);
  }
  ExpectHolds(store);
}

// No second time in full, and not what came in place of what cannot be seen.
TEST_F(UnreadTilesTest, ABaseThatCannotBeReadStaysUntilTheWholeTileCame) {
  TileStore store = OpenFilled();
  const TileId id{0, 1, 1};
  const EncodedTile old = world_.tiles().at(id).encoded;
  world_.Set(1, 1, 5'000);
  const TinyWorld::Stored now = world_.tiles().at(id);
  const TileBlob delta{id, now.revision, now.encoded.payload_hash,
                       *EncodeTileDelta(old.blob, now.encoded.blob), old.payload_hash};
  {
    const NoDescriptors none;
    EXPECT_EQ(store.Put(delta).code(), StatusCode::kResourceExhausted);
    EXPECT_TRUE(store.ComesWhole(id));
  }
  ASSERT_NE(store.Find(id), nullptr);
  ASSERT_TRUE(store.Put(delta).ok());
  EXPECT_FALSE(store.ComesWhole(id));
  EXPECT_EQ(**store.Read(id), now.encoded.blob);
  EXPECT_EQ(Files(), world_.tiles().size());
}

TEST_F(UnreadTilesTest, WhereSectionsCannotBeReadAllOfThemCome) {
  TileStore store = OpenFilled(kSurface);
  SyncPeer peer(world_);
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client) << client.error().message();
  {
    const NoDescriptors none;
    const auto report = SyncStore(*client, store, Everywhere());
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_TRUE(report->is_complete);
  }
  ExpectHolds(store);
}

TEST_F(UnreadTilesTest, AFileAtWhichTheDiskFailsIsReplaced) {
  TileStore store = OpenFilled();
  MakeUnreadable({0, 1, 1});
  SyncPeer peer(world_);
  LinkOptions options;
  options.connection = peer.options();
  AtlasLink link(options);
  AtlasView view(store, &link);
  const auto poor = view.Around(kMiddle, 0.5);
  ASSERT_TRUE(poor) << poor.error().message();
  EXPECT_EQ(poor->disk.code(), StatusCode::kUnavailable);
  EXPECT_TRUE(poor->sync.ok());
  EXPECT_FALSE(poor->is_current);
  EXPECT_EQ(poor->finest_places, 3U);
  EXPECT_EQ(poor->coarse_places, 1U);
  EXPECT_EQ(store.size(), world_.tiles().size());
  const auto map = view.Around(kMiddle, 0.5);
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_TRUE(map->is_current);
  EXPECT_TRUE(map->is_finest_everywhere());
  EXPECT_EQ(map->transfer.tiles, 1U);
  EXPECT_EQ(view.Around(kMiddle, 0.5)->transfer.tiles, 0U);
  store = *TileStore::Open({Bytes(16, 'b'), TinyProfile()}, {});  // lets the folder go
  TileStore again = Open();
  ExpectHolds(again);
}

// With fewer sections than are held, which cannot be joined.
TEST_F(UnreadTilesTest, AFileAtWhichTheDiskFailsIsReplacedByWhatIsAskedFor) {
  TileStore store = OpenFilled();
  const TileId id{0, 1, 1};
  MakeUnreadable(id);
  EXPECT_EQ(store.Read(id).error().code(), StatusCode::kUnavailable);
  EXPECT_TRUE(store.ComesWhole(id));
  SyncPeer peer(world_);
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client) << client.error().message();
  const auto surface = SyncStore(*client, store, Everywhere(kSurface));
  ASSERT_TRUE(surface) << surface.error().message();
  EXPECT_TRUE(surface->is_complete);
  EXPECT_EQ(surface->tiles, 1U);
  EXPECT_EQ(store.Find(id)->sections, kSurface);
  ASSERT_TRUE(SyncStore(*client, store, Everywhere()));
  ExpectHolds(store);
}

// Its file cannot be written either: what came is in memory, and the old file is where it was.
TEST_F(UnreadTilesTest, AFileThatCannotBeWrittenOverStays) {
  TileStore store = OpenFilled();
  const TileId id{0, 1, 1};
  const TinyWorld::Stored& stored = world_.tiles().at(id);
  {
    const NoDescriptors none;
    ASSERT_TRUE(
        store.Put({id, stored.revision, stored.encoded.payload_hash, stored.encoded.blob}).ok());
    EXPECT_EQ(**store.Read(id), stored.encoded.blob);
  }
  EXPECT_EQ(Files(), world_.tiles().size());
  EXPECT_EQ(store.disk_failures(), 0U);
}

}  // namespace
}  // namespace atlas
