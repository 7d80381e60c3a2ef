#include "server/service/fusion/survey_cache.h"

#include <array>
#include <atomic>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/server/service/directory_files.h"

namespace atlas {
namespace {

constexpr TileId Tile(std::int32_t x) {
  return {0, x, 0};
}
KeptSurveys Kept(const TileId& id, std::uint64_t revision) {
  return {TileSurveys(id), revision};
}

class SurveyCacheTest : public ::testing::Test {
 protected:
  ~SurveyCacheTest() override {
    files_.reset();
    std::filesystem::remove_all(directory_);
  }

  SurveyCache& Make(const SurveyCacheLimits& limits, std::size_t disk_bytes = 1u << 30) {
    cache_.reset();
    files_.emplace(
        SurveyFilesOptions{directory_ / "surveys", disk_bytes, 0}, MapProfile(),
        [] {
          return AtlasLine{{{{1}, 0}}, 1'000'000};
        },
        [](LogLevel, const std::string& line) { ADD_FAILURE() << line; });
    return cache_.emplace(limits, *files_);
  }

  std::filesystem::path directory_ = NewDirectory();
  std::optional<SurveyFiles> files_;
  std::optional<SurveyCache> cache_;
};

constexpr SurveyCacheLimits kPlenty{1'000'000, 1'000'000};

TEST_F(SurveyCacheTest, WhatWasPutIsTakenOnce) {
  SurveyCache& cache = Make(kPlenty);
  cache.Put(Kept(Tile(1), 7));
  cache.Trim();
  EXPECT_GT(cache.bytes(), 0u);
  EXPECT_FALSE(cache.Take(Tile(2)).has_value());
  const auto taken = cache.Take(Tile(1));
  ASSERT_TRUE(taken.has_value());
  EXPECT_EQ(taken->revision, 7u);
  EXPECT_EQ(taken->surveys.id(), Tile(1));
  EXPECT_FALSE(cache.Take(Tile(1)).has_value());
  EXPECT_EQ(cache.bytes(), 0u);
}

TEST_F(SurveyCacheTest, WhatIsTooMuchIsCompressedAndThenOnDisk) {
  for (const SurveyCacheLimits& limits : {SurveyCacheLimits{0, 1'000'000}, {0, 0}}) {
    SurveyCache& cache = Make(limits);
    cache.Put(Kept(Tile(1), 7));
    cache.Trim();
    EXPECT_EQ(cache.bytes() == 0, limits.packed_bytes == 0);
    EXPECT_EQ(files_->bytes() > 0, limits.packed_bytes == 0);
    EXPECT_EQ(cache.Take(Tile(1))->revision, 7u);
  }
}

TEST_F(SurveyCacheTest, TheLaterRevisionStays) {
  for (const bool is_packed : {false, true}) {
    SurveyCache& cache = Make({is_packed ? 0u : 1'000'000u, 1'000'000});
    cache.Put(Kept(Tile(1), 9));
    cache.Trim();
    cache.Put(Kept(Tile(1), 8));
    cache.Trim();
    EXPECT_EQ(cache.Take(Tile(1))->revision, 9u);
    EXPECT_FALSE(cache.Take(Tile(1)).has_value());
    cache.Put(Kept(Tile(1), 9));
    cache.Trim();
    cache.Put(Kept(Tile(1), 10));
    EXPECT_EQ(cache.Take(Tile(1))->revision, 10u);
    EXPECT_FALSE(cache.Take(Tile(1)).has_value());
    EXPECT_EQ(cache.bytes(), 0u);
  }
}

TEST_F(SurveyCacheTest, WhatIsIdleIsWrittenOnceAndStays) {
  SurveyCacheLimits limits = kPlenty;
  SurveyCache& busy = Make(limits);
  busy.Put(Kept(Tile(1), 7));
  EXPECT_FALSE(busy.StoreIdle()) << "it was used a moment ago";
  limits.idle = std::chrono::milliseconds(-1);
  SurveyCache& cache = Make(limits);
  cache.Put(Kept(Tile(1), 7));
  cache.Put(Kept(Tile(2), 7));
  EXPECT_TRUE(cache.StoreIdle());
  EXPECT_TRUE(cache.StoreIdle());
  EXPECT_FALSE(cache.StoreIdle());
  EXPECT_GT(cache.bytes(), 0u);
  EXPECT_EQ(cache.Take(Tile(1))->revision, 7u);
  cache.Put(Kept(Tile(1), 8));
  EXPECT_TRUE(cache.StoreIdle()) << "it changed";
}

// Else they would push each other out for ever.
TEST_F(SurveyCacheTest, WhatIsIdleIsWrittenOnceThoughTheDiskHasNoRoomForAll) {
  SurveyCacheLimits limits = kPlenty;
  limits.idle = std::chrono::milliseconds(-1);
  SurveyCache& cache = Make(limits, 200);
  for (std::int32_t tile = 0; tile < 8; ++tile) {
    cache.Put(Kept(Tile(tile), 7));
  }
  int written = 0;
  while (written < 100 && cache.StoreIdle()) {
    ++written;
  }
  EXPECT_EQ(written, 8);
  EXPECT_GT(files_->bytes(), 0u);
  EXPECT_LE(files_->bytes(), 200u);
}

TEST_F(SurveyCacheTest, WhatWasWrittenAndIsGoneIsWrittenAgain) {
  SurveyCacheLimits limits = kPlenty;
  limits.idle = std::chrono::milliseconds(-1);
  SurveyCache& cache = Make(limits);
  cache.Put(Kept(Tile(1), 7));
  ASSERT_TRUE(cache.StoreIdle());
  std::filesystem::remove_all(directory_ / "surveys");
  EXPECT_FALSE(files_->Read(Tile(1)).has_value());
  EXPECT_GT(cache.MoveToDisk(), 0u);
  EXPECT_EQ(cache.bytes(), 0u);
  EXPECT_EQ(cache.Take(Tile(1))->revision, 7u);
}

// Workers that take, change and put back, each tile one worker's at a time: none ever finds less
// than what was put last, whatever is compressed, written and read meanwhile.
TEST_F(SurveyCacheTest, NothingIsEverMissedOrOlder) {
  SurveyCacheLimits limits{2'000, 1'000};
  limits.idle = std::chrono::milliseconds(-1);
  SurveyCache& cache = Make(limits);
  constexpr std::int32_t kTiles = 12;
  std::array<std::mutex, kTiles> leases;
  std::array<std::uint64_t, kTiles> revisions{};
  std::vector<std::jthread> workers;
  for (std::uint32_t seed = 0; seed < 4; ++seed) {
    workers.emplace_back([&, seed] {
      std::mt19937 random(seed);
      for (int i = 0; i < 300; ++i) {
        const auto tile = static_cast<std::int32_t>(random() % kTiles);
        const std::unique_lock lease(leases[static_cast<std::size_t>(tile)], std::try_to_lock);
        if (lease.owns_lock()) {
          std::uint64_t& revision = revisions[static_cast<std::size_t>(tile)];
          const auto taken = cache.Take(Tile(tile));
          EXPECT_EQ(taken ? taken->revision : 0, revision);
          cache.Put(Kept(Tile(tile), ++revision));
        }
        if (random() % 3 == 0) {
          cache.StoreIdle();
        }
        cache.Trim();
      }
    });
  }
  workers.clear();
  for (std::int32_t tile = 0; tile < kTiles; ++tile) {
    EXPECT_EQ(cache.Take(Tile(tile))->revision, revisions[static_cast<std::size_t>(tile)]);
  }
}

}  // namespace
}  // namespace atlas
