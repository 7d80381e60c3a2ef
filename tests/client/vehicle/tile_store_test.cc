// What a vehicle holds is what a fresh sync would bring, whatever happened to links, disks and
// programs in between.
#include "client/vehicle/tile_store.h"

#include <fstream>
#include <random>

#include "client/vehicle/store_sync.h"
#include "core/base/hash.h"
#include "core/tile/tile_container.h"
#include "core/tile/tile_delta.h"
#include "tests/client/vehicle/sync_peer.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr SectionBits kSurface = 1U << 1U | 1U << 2U;

SyncQuery Everywhere() {
  SyncQuery query;
  query.area = DiscArea{{0.0, 0.0}, 1e5};
  return query;
}

TileStore OpenStore(const TileStoreOptions& options) {
  return *TileStore::Open(TinyAtlas(), options);
}

Result<StoreSyncReport> SyncOnce(const TinyWorld& world,
                                 TileStore& store,
                                 const SyncQuery& query = Everywhere(),
                                 int frames_until_cut = SyncPeer::kNever) {
  SyncPeer peer(world, frames_until_cut);
  auto client = AtlasClient::Connect(peer.options());
  if (!client) return Error(client.error());
  return SyncStore(*client, store, query);
}

void ExpectHolds(TileStore& store, const TinyWorld& world) {
  EXPECT_EQ(store.size(), world.tiles().size());
  for (const auto& [id, stored] : world.tiles()) {
    const auto blob = store.Read(id);
    ASSERT_TRUE(blob) << blob.error().message();
    EXPECT_EQ(**blob, stored.encoded.blob) << id;
    EXPECT_EQ(store.Find(id)->payload_hash, stored.encoded.payload_hash) << id;
  }
}

std::vector<fs::path> TilePaths(const fs::path& root) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.path().extension() == ".tile") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

TEST(TileStoreTest, ASecondSyncSendsNothingAgain) {
  const TinyWorld world = SquareWorld(9);
  TileStore store = OpenStore({});
  const auto first = SyncOnce(world, store);
  ASSERT_TRUE(first) << first.error().message();
  EXPECT_TRUE(first->is_complete);
  EXPECT_EQ(first->tiles, world.tiles().size());
  ExpectHolds(store, world);
  const auto second = SyncOnce(world, store);
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->is_complete);
  EXPECT_EQ(second->tiles, 0U);
  EXPECT_EQ(second->requests, 1U);
}

TEST(TileStoreTest, ManyTilesAreToldAsBlocksFewOneByOne) {
  const TinyWorld world = SquareWorld(9);
  TileStore store = OpenStore({});
  ASSERT_TRUE(SyncOnce(world, store));
  HeldInPart in_part;
  const auto held = store.Held(Everywhere().area, 0, 3, in_part);
  EXPECT_TRUE(in_part.empty());
  ASSERT_EQ(held.size(), 1U);
  EXPECT_LT(24 * held[0].blocks.size() + 16 * held[0].tiles.size(), 4 * store.size());
  EXPECT_FALSE(held[0].tiles.empty());
  EXPECT_FALSE(held[0].blocks.empty());
}

TEST(TileStoreTest, ChangedTilesOfABlockComeAndNoOther) {
  TinyWorld world = SquareWorld(8);
  TileStore store = OpenStore({});
  ASSERT_TRUE(SyncOnce(world, store));
  world.Set(3, 3, 5'000);
  world.Erase(7, 7);
  const auto report = SyncOnce(world, store);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->is_complete);
  EXPECT_EQ(report->requests, 2U);  // a block differs, then its tiles one by one
  std::uint64_t changed = 0;
  for (const auto& [id, stored] : world.tiles()) {
    changed += stored.revision > world.revision() - 2 ? 1U : 0U;
  }
  EXPECT_EQ(report->tiles, changed);
  ExpectHolds(store, world);
}

TEST(TileStoreTest, DifferingBlocksAreRememberedWhenTheBudgetEnds) {
  TinyWorld world = SquareWorld(8);
  TileStore store = OpenStore({});
  ASSERT_TRUE(SyncOnce(world, store));
  world.Set(3, 3, 5'000);
  SyncQuery query = Everywhere();
  query.budget_bytes = 600;
  const auto cut = SyncOnce(world, store, query);
  ASSERT_TRUE(cut) << cut.error().message();
  EXPECT_FALSE(cut->is_complete);
  const auto rest = SyncOnce(world, store);
  ASSERT_TRUE(rest);
  EXPECT_EQ(rest->requests, 1U);
  ExpectHolds(store, world);
}

TEST(TileStoreTest, ChangedTilesComeAsDeltas) {
  TinyWorld world = SquareWorld(8);
  TileStore store = OpenStore({});
  ASSERT_TRUE(SyncOnce(world, store));
  world.Set(3, 3, 5'000);
  const auto report = SyncOnce(world, store);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_GT(report->tiles, 1U);
  EXPECT_EQ(report->deltas, report->tiles);
  ExpectHolds(store, world);
}

TEST(TileStoreTest, ADeltaIsOfNoUseWithoutItsBase) {
  TinyWorld world;
  world.Set(0, 0, 100);
  const TileId id{0, 0, 0};
  const EncodedTile base = world.tiles().at(id).encoded;
  world.Set(0, 0, 300);
  const EncodedTile target = world.tiles().at(id).encoded;
  const TileBlob delta{id, 2, target.payload_hash, *EncodeTileDelta(base.blob, target.blob),
                       base.payload_hash};
  TileStore store = OpenStore({});
  EXPECT_EQ(store.Put(delta).code(), StatusCode::kInvalidData) << "nothing held";
  ASSERT_TRUE(store.Put({id, 1, base.payload_hash, base.blob}).ok());
  ASSERT_TRUE(store.Put(delta).ok());
  EXPECT_EQ(**store.Read(id), target.blob);
  EXPECT_EQ(store.Put(delta).code(), StatusCode::kInvalidData) << "another base";
  EXPECT_EQ(store.Find(id), nullptr) << "it comes as a whole the next time";
}

// The tiles that the deltas are made against are too many for the store.
TEST(TileStoreTest, WhereTheBaseIsGoneTheWholeTileComes) {
  TinyWorld world = SquareWorld(6);
  TileStore store = OpenStore({.max_memory_bytes = 4'000});
  ASSERT_TRUE(SyncOnce(world, store));
  ASSERT_LT(store.size(), world.tiles().size());
  for (int x = 0; x < 6; ++x) {
    world.Set(x, 2, 9'000 + x);
  }
  const auto report = SyncOnce(world, store);
  ASSERT_TRUE(report) << report.error().message();
  for (const TileId& id : store.Tiles()) {
    EXPECT_EQ(store.Find(id)->payload_hash, world.tiles().at(id).encoded.payload_hash) << id;
  }
}

TEST(TileStoreTest, SectionsAreMerged) {
  const TinyWorld world = SquareWorld(3);
  TileStore store = OpenStore({});
  SyncQuery query = Everywhere();
  query.sections = kSurface;
  const auto surface = SyncOnce(world, store, query);
  ASSERT_TRUE(surface) << surface.error().message();
  const TileId id{0, 1, 1};
  EXPECT_EQ(**store.Read(id), *SelectSections(world.tiles().at(id).encoded.blob, kSurface));
  const auto rest = SyncOnce(world, store);
  ASSERT_TRUE(rest) << rest.error().message();
  EXPECT_LT(rest->bytes, surface->bytes);
  ExpectHolds(store, world);
}

TEST(TileStoreTest, ABlobThatIsNotWhatItsHashSaysIsNotKept) {
  const TinyWorld world = SquareWorld(1);
  const TileId id{0, 0, 0};
  const EncodedTile& encoded = world.tiles().at(id).encoded;
  TileStore store = OpenStore({});
  Bytes damaged = encoded.blob;
  damaged.back() ^= 1U;
  for (const TileBlob& tile : {TileBlob{id, 1, encoded.payload_hash + 1, encoded.blob},
                               TileBlob{{0, 1, 0}, 1, encoded.payload_hash, encoded.blob},
                               TileBlob{id, 1, encoded.payload_hash, damaged},
                               TileBlob{id, 1, encoded.payload_hash, {}}}) {
    EXPECT_EQ(store.Put(tile).code(), StatusCode::kInvalidData);
    EXPECT_EQ(store.size(), 0U);
  }
  EXPECT_TRUE(store.Put({id, 1, encoded.payload_hash, encoded.blob}).ok());
}

TEST(TileStoreTest, MemoryIsBoundedAndCoarseTilesGoLast) {
  const TinyWorld world = SquareWorld(9);
  constexpr std::size_t kBound = 6'000;
  TileStore store = OpenStore({.max_memory_bytes = kBound, .folder = {}});
  ASSERT_TRUE(SyncOnce(world, store));
  EXPECT_LE(store.memory_bytes(), kBound);
  EXPECT_GT(store.size(), 4U);
  EXPECT_LT(store.size(), world.tiles().size());
  for (const auto& [id, stored] : world.tiles()) {
    EXPECT_TRUE(id.level < 3 || store.Find(id) != nullptr) << id;
  }
}

TEST(TileStoreTest, WhatIsOnDiskOutlivesTheStoreAndItsMemory) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(6);
  const TileStoreOptions options{.max_memory_bytes = 2'000, .folder = folder.path()};
  {
    TileStore store = OpenStore(options);
    ASSERT_TRUE(SyncOnce(world, store));
    ExpectHolds(store, world);
  }
  ASSERT_EQ(KnownAtlases(folder.path()), std::vector{TinyAtlas()});
  TileStore again = OpenStore(options);
  const auto report = SyncOnce(world, again);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->tiles, 0U);
  ExpectHolds(again, world);
  EXPECT_LE(again.memory_bytes(), 2'000U);
}

// Whatever the order of the folders, and also when the clock was set back in between.
TEST(TileStoreTest, TheAtlasThatWasOpenedLastIsTheFirstKnown) {
  const TestFolder folder;
  const TileStoreOptions options{.folder = folder.path()};
  std::vector<AtlasKey> atlases;
  for (const std::uint8_t id : Bytes{7, 3, 9, 1}) {
    atlases.push_back({Bytes(16, id), TinyProfile()});
  }
  for (const std::size_t last : {0U, 1U, 2U, 3U, 1U, 0U, 0U, 2U}) {
    ASSERT_TRUE(TileStore::Open(atlases[last], options));
    EXPECT_EQ(KnownAtlases(folder.path()).at(0), atlases[last]);
  }
  for (const auto& entry : fs::recursive_directory_iterator(folder.path())) {
    if (entry.path().filename() != "atlas") continue;
    fs::last_write_time(entry.path(), fs::last_write_time(entry.path()) + std::chrono::hours(24));
  }
  ASSERT_TRUE(TileStore::Open(atlases[3], options));
  EXPECT_EQ(KnownAtlases(folder.path()),
            (std::vector{atlases[3], atlases[2], atlases[0], atlases[1]}));
}

TEST(TileStoreTest, WithoutAFolderThatCanBeMadeItWorksInMemory) {
  const TestFolder folder;
  std::ofstream(folder.path() / "file") << "no folder can be made below it";
  TileStoreOptions options;
  options.folder = folder.path() / "file" / "tiles";
  auto store = TileStore::Open(TinyAtlas(), options);
  ASSERT_TRUE(store) << store.error().message();
  EXPECT_FALSE(store->disk_problem().ok());
  const TinyWorld world = SquareWorld(2);
  ASSERT_TRUE(SyncOnce(world, *store));
  ExpectHolds(*store, world);
  EXPECT_EQ(store->disk_failures(), store->size());
  EXPECT_EQ(store->disk_bytes(), 0U);
  EXPECT_EQ(TileStore::Open({Bytes(3, 1), TinyProfile()}, options).error().code(),
            StatusCode::kInvalidArgument);
}

TEST(TileStoreTest, DiskIsBounded) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(6);
  const TileStoreOptions options{
      .max_memory_bytes = 1'000, .folder = folder.path(), .max_disk_bytes = 5'000};
  TileStore store = OpenStore(options);
  ASSERT_TRUE(SyncOnce(world, store));
  std::uintmax_t bytes = 0;
  for (const fs::path& path : TilePaths(folder.path())) {
    bytes += fs::file_size(path);
  }
  EXPECT_EQ(bytes, store.disk_bytes());
  EXPECT_LE(bytes, 5'000U);
  EXPECT_LE(OpenStore({.folder = folder.path(), .max_disk_bytes = 2'000}).disk_bytes(), 2'000U);
}

TEST(TileStoreTest, DamagedFilesAreDroppedAndFetchedAgain) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(4);
  const TileStoreOptions options{.folder = folder.path()};
  {
    TileStore store = OpenStore(options);
    ASSERT_TRUE(SyncOnce(world, store));
  }
  const auto paths = TilePaths(folder.path());
  ASSERT_GE(paths.size(), 6U);
  fs::resize_file(paths[0], fs::file_size(paths[0]) - 1);
  fs::resize_file(paths[1], 0);
  std::fstream(paths[2], std::ios::in | std::ios::out | std::ios::binary).seekp(100).put('?');
  fs::copy_file(paths[3], paths[4], fs::copy_options::overwrite_existing);
  std::ofstream(folder.path() / paths[5].parent_path() / "x.tile.partial") << "half";
  std::ofstream(folder.path() / paths[5].parent_path() / "other") << "not ours";
  TileStore store = OpenStore(options);
  std::size_t damaged = 0;
  for (const TileId& id : store.Tiles()) {
    const auto blob = store.Read(id);
    damaged += !blob && blob.error().code() == StatusCode::kInvalidData ? 1U : 0U;
  }
  EXPECT_EQ(damaged, 4U);
  EXPECT_EQ(store.size(), paths.size() - 4);
  EXPECT_EQ(TilePaths(folder.path()).size(), paths.size() - 4);
  const auto report = SyncOnce(world, store);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->tiles, 4U);
  ExpectHolds(store, world);
  EXPECT_FALSE(fs::exists(paths[5].parent_path() / "x.tile.partial"));
  EXPECT_TRUE(fs::exists(paths[5].parent_path() / "other"));
}

TEST(TileStoreTest, FilesOfAnotherAtlasAreNotBelieved) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(2);
  {
    TileStore store = OpenStore({.folder = folder.path()});
    ASSERT_TRUE(SyncOnce(world, store));
  }
  const AtlasKey other{Bytes(16, 'b'), TinyProfile()};
  EXPECT_EQ(TileStore::Open(other, {.folder = folder.path()})->size(), 0U);
  for (const fs::path& path : TilePaths(folder.path())) {
    fs::copy_file(path, folder.path() / "62626262626262626262626262626262" / path.filename());
  }
  TileStore store = *TileStore::Open(other, {.folder = folder.path()});
  ASSERT_GT(store.size(), 0U);
  for (const TileId& id : store.Tiles()) {
    EXPECT_EQ(store.Read(id).error().code(), StatusCode::kInvalidData);
  }
  EXPECT_EQ(store.size(), 0U);
  EXPECT_EQ(SyncOnce(world, store).error().code(), StatusCode::kConflict);
}

TEST(TileStoreTest, AFolderOfTwentyThousandTilesIsOpenedWithoutReadingThem) {
  const TestFolder folder;
  Result<TileFiles> files = TileFiles::Open(folder.path(), TinyAtlas());
  ASSERT_TRUE(files);
  for (int i = 0; i < 20'000; ++i) {
    ASSERT_TRUE(files->Write({{0, i % 200, i / 200}, 1, 2, 3}, Bytes(10)));
  }
  const auto start = std::chrono::steady_clock::now();
  const TileStore store = OpenStore({.folder = folder.path()});
  EXPECT_EQ(store.size(), 20'000U);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
}

// Random changes, areas, sections, budgets, cuts and restarts, then one undisturbed sync.
TEST(TileStoreTest, AfterAnyHistoryItHoldsWhatAFreshSyncBrings) {
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    const TestFolder folder;
    std::mt19937 random(seed);
    TinyWorld world;
    world.ChangeSome(random, 12, 80);
    const TileStoreOptions options{
        .max_memory_bytes = seed % 2 == 0 ? std::size_t{1} << 20U : 3'000,
        .folder = seed % 3 == 0 ? fs::path() : folder.path()};
    auto store = std::make_unique<TileStore>(OpenStore(options));
    for (int step = 0; step < 12; ++step) {
      world.ChangeSome(random, 12, static_cast<int>(random() % 6));
      SyncQuery query;
      std::uniform_real_distribution<double> place_m(-10.0, 10.0);
      query.area = DiscArea{{place_m(random), place_m(random)}, 10.0 + place_m(random)};
      query.finest_level = static_cast<std::uint8_t>(random() % 2);
      query.budget_bytes = random() % 2 == 0 ? 0 : 1'500 + random() % 20'000;
      query.sections = random() % 3 == 0 ? kSurface : kEverySection;
      const int cut = random() % 2 == 0 ? SyncPeer::kNever : static_cast<int>(random() % 40);
      (void)SyncOnce(world, *store, query, cut);
      if (random() % 4 == 0) store = std::make_unique<TileStore>(OpenStore(options));
    }
    TileStoreOptions roomy = options;
    roomy.max_memory_bytes = std::size_t{1} << 24U;
    if (!options.folder.empty()) store = std::make_unique<TileStore>(OpenStore(roomy));
    const auto last = SyncOnce(world, *store);
    ASSERT_TRUE(last) << last.error().message();
    if (options.folder.empty() && seed % 2 != 0) continue;  // bounded below the whole map
    EXPECT_TRUE(last->is_complete);
    ExpectHolds(*store, world);
  }
}

}  // namespace
}  // namespace atlas
