// Another version's atlas: what it was fused by other rules is fused again, and only then
// (decision 0308).
#include <map>

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

constexpr std::uint32_t kDrive = 6;

class FusionRulesTest : public ServiceTest {
 protected:
  AtlasDigest Reference() {
    Open(1, "reference");
    UploadDrive(kDrive);
    return Digest();
  }
  // An atlas whose tiles are what `content` says of them, by `rules`, and nothing is owed.
  void OpenOther(std::uint64_t rules,
                 const std::function<std::optional<TileContent>(const TileId&)>& content) {
    Open(0);
    ASSERT_EQ(Adopt(rules), 0U);
    UploadDrive(kDrive);
    for (int wave = 0; wave < 20; ++wave) {
      const ClaimRequest request{"other", kTestNow_ms, 60'000, 1'000, 1U << 30};
      const ClaimResult claims = Await<ClaimResult>([&](auto done) {
                                   store_->ClaimDirty(request, std::move(done));
                                 }).value();
      for (const TileClaim& claim : claims.claims) {
        const auto finished = Await<FinishResult>([&](auto done) {
          store_->FinishTile({claim, claim.generation, content(claim.id)}, std::move(done));
        });
        ASSERT_TRUE(finished) << finished.error().message();
      }
    }
    ASSERT_EQ(store_->ReadDirtyState()->dirty_tiles, 0U);
  }
  // Whether the store is open or not.
  void Execute(const std::string& name, const char* sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((directory_ / name / "atlas.db").c_str(), &db), SQLITE_OK);
    sqlite3_busy_timeout(db, 10'000);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }
  std::map<TileId, TileContent> ContentOf(const std::string& name) {
    Open(0, name);
    std::map<TileId, TileContent> contents;
    const std::vector<TileSummary> tiles = store_->ListTiles(-1, 10'000).value();
    for (const TileSummary& tile : tiles) {
      const StoredTile stored = store_->ReadTile(tile.id).value().value();
      contents[tile.id] = TileContent{stored.blob, stored.payload_hash, 10, 1};
    }
    return contents;
  }
  std::uint64_t Adopt(std::uint64_t rules) {
    const auto marks =
        Await<std::uint64_t>([&](auto done) { store_->AdoptFusionRules(rules, std::move(done)); });
    EXPECT_TRUE(marks) << marks.error().message();
    return marks.value_or(0);
  }
};

TEST_F(FusionRulesTest, TilesThatOtherRulesFoundNothingInAreFusedAgain) {
  const AtlasDigest expected = Reference();
  OpenOther(1, [](const TileId&) { return std::nullopt; });
  Open(2);
  const AtlasDigest digest = Digest();
  EXPECT_EQ(digest.sha256, expected.sha256);
  EXPECT_EQ(digest.tiles, expected.tiles);
}

TEST_F(FusionRulesTest, TilesOfOtherContentOnAllLevelsAreFusedAgain) {
  const AtlasDigest expected = Reference();
  const auto contents = ContentOf("reference");
  const TileContent other = contents.begin()->second;
  OpenOther(0, [&](const TileId& id) {
    return contents.contains(id) ? std::optional(other) : std::nullopt;
  });
  ASSERT_EQ(store_->ListTiles(-1, 10'000)->size(), expected.tiles);
  Open(1);  // by rules that nobody named
  EXPECT_EQ(Digest().sha256, expected.sha256);
}

TEST_F(FusionRulesTest, AParentThatNoChildChangesIsFusedAgain) {
  const AtlasDigest expected = Reference();
  const auto contents = ContentOf("reference");
  OpenOther(3, [&](const TileId& id) -> std::optional<TileContent> {
    const auto found = contents.find(id);
    if (found == contents.end()) return std::nullopt;
    TileContent content = found->second;
    content.payload_hash += id.level > 1 ? 1U : 0U;
    return content;
  });
  Open(1);
  EXPECT_EQ(Digest().sha256, expected.sha256);
}

TEST_F(FusionRulesTest, BySameRulesNothingIsFusedAgain) {
  const AtlasDigest expected = Reference();
  Open(1, "reference");
  EXPECT_EQ(Digest().revision, expected.revision);
  EXPECT_EQ(service_->ReadStatus()->tiles_built, 0U);
}

TEST_F(FusionRulesTest, WhoDoesNotFuseMarksNothing) {
  OpenOther(1, [](const TileId&) { return std::nullopt; });
  const std::uint64_t revision = store_->revision();
  Open(0);
  EXPECT_EQ(store_->revision(), revision);
  EXPECT_EQ(store_->ReadDirtyState()->dirty_tiles, 0U);
}

TEST_F(FusionRulesTest, AnEmptyAtlasStaysAtItsRevision) {
  Open(1);
  EXPECT_EQ(store_->revision(), 0U);
  EXPECT_EQ(store_->ReadDirtyState()->dirty_tiles, 0U);
}

TEST_F(FusionRulesTest, AnAtlasOfAVersionWithoutTheNumberIsTakenForAnother) {
  Reference();
  const std::uint64_t revision = store_->revision();
  Close();
  Execute("reference", "DELETE FROM counters WHERE id = 14");
  Open(0, "reference");
  EXPECT_GT(Adopt(4), 20U);
  EXPECT_EQ(store_->revision(), revision + 1);
  EXPECT_EQ(Adopt(4), 0U);
  EXPECT_EQ(store_->revision(), revision + 1);
}

TEST_F(FusionRulesTest, AParentThatIsNotThereIsBuilt) {
  const AtlasDigest expected = Reference();
  const auto contents = ContentOf("reference");
  OpenOther(3, [&](const TileId& id) -> std::optional<TileContent> {
    const auto found = contents.find(id);
    return found == contents.end() || id.level > 0 ? std::nullopt : std::optional(found->second);
  });
  Open(1);
  EXPECT_EQ(Digest().sha256, expected.sha256);
}

TEST_F(FusionRulesTest, ADamagedRowOfAFootprintStopsNothing) {
  OpenOther(1, [](const TileId&) { return std::nullopt; });
  Close();
  Execute("data",
          "INSERT INTO keyframe_tiles (tile_key, keyframe_id, revision, is_current, checksum) "
          "VALUES (-1, 1, 1, 1, 7), (9223372036854775807, 1, 1, 1, 7)");
  Open(1);
  const auto wait = service_->WaitUntilClean(Long());
  ASSERT_TRUE(wait) << wait.error().message();
  EXPECT_EQ(wait->dirty_tiles, 0U);
  EXPECT_GT(store_->ListTiles(-1, 10'000)->size(), 20U);
}

// A full disk, say: nobody is told that the map of other rules is the map, and it goes on by
// itself.
TEST_F(FusionRulesTest, UntilTheStoreTakesTheRulesNothingCountsAsFused) {
  const AtlasDigest expected = Reference();
  OpenOther(1, [](const TileId&) { return std::nullopt; });
  OpenStore();
  Execute("data",
          "CREATE TRIGGER full BEFORE UPDATE ON counters WHEN new.id = 14 "
          "BEGIN SELECT raise(ABORT, 'full'); END");
  Serve(1);
  const Patience brief{std::chrono::milliseconds(50), {}};
  const auto wait = service_->WaitUntilClean(brief);
  ASSERT_FALSE(wait);
  EXPECT_THAT(wait.error().message(), ::testing::HasSubstr("fusion cannot begin"));
  EXPECT_FALSE(service_->Digest(brief));
  EXPECT_FALSE(service_->WaitForRevision(store_->revision(), brief).ok());
  EXPECT_EQ(service_->ReadStatus()->tiles_built, 0U);
  Execute("data", "DROP TRIGGER full");
  EXPECT_EQ(Digest().sha256, expected.sha256);
}

}  // namespace
}  // namespace atlas
