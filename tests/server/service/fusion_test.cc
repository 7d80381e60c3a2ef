// The atlas as a whole: whatever happened on the way, the same keyframes and poses make the same
// tiles; and what is damaged is found.
#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/core/support/test_scale.h"
#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

constexpr std::uint32_t kDrive = 14;

class AtlasTest : public ServiceTest {
 protected:
  void Tamper(const std::string& name, const std::string& sql) {
    Close();
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((directory_ / name / "atlas.db").c_str(), &db), SQLITE_OK);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }
  AtlasDigest Reference() {
    Open(1, "reference");
    UploadDrive(kDrive);
    return Digest();
  }
};

TEST_F(AtlasTest, OrderDuplicatesWorkersRestartsAndDetoursDoNotMatter) {
  const AtlasDigest expected = Reference();
  ASSERT_GT(expected.tiles, 20u);
  for (std::uint32_t seed = 0; seed < testing::Scaled(6); ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < kDrive; ++i) {
      order.insert(order.end(), 1 + random() % 2, i);  // some are sent twice
    }
    std::shuffle(order.begin(), order.end(), random);
    const std::string name = "case" + std::to_string(seed);
    Open(1 + seed % 3, name);
    for (std::size_t n = 0; n < order.size(); ++n) {
      UploadRequest request = DriveUpload(order[n]);
      const QuantizedPose pose = request.pose;
      const KeyframeKey key = request.key;
      if (random() % 3 == 0) {
        request.pose = PoseOf({3.0, -2.0, 0.5, 77.0});  // which a vehicle can do
      }
      ASSERT_TRUE(Upload(std::move(request)).has_value());
      ASSERT_TRUE(Move({{key, PoseOf({-15.0, 9.0, 1.0, 10.0})}}).has_value());
      ASSERT_TRUE(Move({{key, pose}}).has_value());
      if (random() % 5 == 0) {
        Open(1 + static_cast<unsigned>(n % 3), name);
      }
    }
    const AtlasDigest digest = Digest();
    EXPECT_EQ(digest.sha256, expected.sha256);
    EXPECT_EQ(digest.tiles, expected.tiles);
    const auto report = service_->Verify({.rebuild = true}, Long());
    ASSERT_TRUE(report.has_value()) << report.error().message();
    EXPECT_EQ(report->damaged, 0u);
    EXPECT_EQ(report->mismatched, 0u);
    EXPECT_EQ(report->checked, kDrive + digest.tiles);
  }
}

TEST_F(AtlasTest, AMoveFusesOnlyWhatItTouches) {
  Open(1);
  UploadDrive(kDrive);
  Digest();
  const auto before = store_->ListTiles(-1, 10'000).value();
  const auto moved = Move({{DriveUpload(0).key, PoseOf({-6.3, 0.1, 1.8, 2.0})}});
  ASSERT_TRUE(moved.has_value());
  const AtlasDigest digest = Digest();
  std::size_t changed_level0 = 0;
  const auto after = store_->ListTiles(-1, 10'000).value();
  for (const TileSummary& tile : after) {
    changed_level0 += tile.id.level == 0 && tile.revision >= moved->revision ? 1u : 0u;
  }
  EXPECT_GT(changed_level0, 0u);
  EXPECT_LE(changed_level0, moved->tiles_marked);
  EXPECT_LT(changed_level0, before.size() / 2);
  EXPECT_GT(digest.revision, moved->revision);
}

TEST_F(AtlasTest, CountsComeFromLevel0) {
  Open(1);
  UploadDrive(3);
  Digest();
  const StoreCounts counts = service_->ReadStatus()->counts;
  EXPECT_GT(counts.cells, 1000u);
  EXPECT_LT(counts.cells, 48u * 48u * 3u + 1);
  EXPECT_GT(service_->ReadStatus()->rss_bytes, 1u << 20);
}

TEST_F(AtlasTest, VerifyCountsDamagedTilesAndKeyframes) {
  Open(1);
  UploadDrive(4);
  const AtlasDigest clean = Digest();
  Tamper("data",
         "UPDATE tiles SET blob = zeroblob(length(blob)) WHERE key = (SELECT min(key) FROM tiles);"
         "UPDATE keyframes SET blob = zeroblob(length(blob)) WHERE id = 2");
  Open(1);
  const auto report = service_->Verify({}, Long());
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->damaged, 2u);
  EXPECT_EQ(report->checked, 4 + clean.tiles);
  EXPECT_EQ(report->findings.size(), 2u);
  EXPECT_EQ(service_->Digest(Long()).error().code(), StatusCode::kInvalidData);
}

TEST_F(AtlasTest, VerifyAndDigestGiveUpInTime) {
  Open(1);
  UploadDrive(4);
  Digest();
  const Patience none{std::chrono::milliseconds(0), {}};
  EXPECT_EQ(service_->Verify({}, none).error().code(), StatusCode::kTimeout);
  EXPECT_EQ(service_->Verify({.rebuild = true}, none).error().code(), StatusCode::kTimeout);
  EXPECT_EQ(service_->Digest(none).error().code(), StatusCode::kTimeout);
}

TEST_F(AtlasTest, VerifyNoticesKeyframesThatVanished) {
  Open(1);
  UploadDrive(4);
  Digest();
  Tamper("data", "DELETE FROM keyframes WHERE id = 2");
  Open(1);
  const auto report = service_->Verify({}, Long());
  ASSERT_TRUE(report.has_value());
  using ::testing::HasSubstr;
  EXPECT_THAT(report->findings,
              ::testing::ElementsAre(HasSubstr("store: counter keyframes is 4, and the rows say 3"),
                                     "store: the row of keyframe 2 is missing"));
  EXPECT_EQ(report->damaged, 2u);
}

// What the next fusion of a tile hangs on, though its content is right now.
TEST_F(AtlasTest, VerifyNoticesLostRevisions) {
  for (const char* tampering :
       {"UPDATE keyframe_tiles SET revision = 0 WHERE keyframe_id = 2",
        "UPDATE keyframe_tiles SET revision = revision + 1 WHERE keyframe_id = 2"}) {
    Open(1);
    UploadDrive(4);
    Digest();
    EXPECT_EQ(service_->Verify({}, Long())->damaged, 0u);
    Tamper("data", tampering);
    Open(1);
    EXPECT_EQ(service_->Verify({}, Long())->damaged, 1u) << tampering;
    Close();
    std::filesystem::remove_all(directory_ / "data");
  }
}

TEST_F(AtlasTest, VerifyIsContentAfterEverySortOfChange) {
  Open(1);
  UploadDrive(4);
  const auto move = [this](std::uint32_t i, double x_m) {
    UploadRequest moved = DriveUpload(i);
    moved.pose = PoseOf({x_m, 0, 0, 0});
    ASSERT_TRUE(Move({{moved.key, moved.pose}}).has_value());
  };
  move(2, 30.0);
  ASSERT_TRUE(Change("day", SessionAction::kRetract).has_value());
  move(1, -20.0);
  EXPECT_EQ(service_->Verify({.rebuild = true}, Long())->damaged, 0u);
  ASSERT_TRUE(Change("day", SessionAction::kRestore).has_value());
  move(2, 0.0);
  const auto report = service_->Verify({.rebuild = true}, Long());
  EXPECT_EQ(report->damaged, 0u) << report->findings.at(0);
  EXPECT_EQ(report->mismatched, 0u);
}

TEST_F(AtlasTest, RebuildFindsTilesThatAreNotWhatTheirKeyframesMake) {
  Open(1);
  UploadDrive(4);
  Digest();
  // A tile goes missing, and a whole keyframe leaves the index: which tiles it made, only fusing
  // tells.
  Tamper("data",
         "DELETE FROM tiles WHERE key = (SELECT min(key) FROM tiles);"
         "DELETE FROM keyframe_tiles WHERE keyframe_id = 1");
  Open(1);
  const auto plain = service_->Verify({}, Long());
  EXPECT_EQ(plain->damaged, 2u);
  EXPECT_EQ(plain->mismatched, 1u);
  ASSERT_EQ(plain->findings.size(), 3u);
  EXPECT_THAT(plain->findings[0], ::testing::HasSubstr("store: counter tiles is "));
  EXPECT_EQ(plain->findings[1], "keyframe bus/day/0: the store lists other tiles than it touches");
  EXPECT_THAT(plain->findings[2], ::testing::EndsWith(" is missing"));
  const auto rebuilt = service_->Verify({.rebuild = true}, Long());
  ASSERT_TRUE(rebuilt.has_value()) << rebuilt.error().message();
  EXPECT_GT(rebuilt->mismatched, 1u);
}

TEST_F(AtlasTest, ADamagedKeyframeStopsItsTilesAndNoOthers) {
  Open(0);
  UploadDrive(4);
  UploadRequest far = DriveUpload(4, "elsewhere");
  far.pose = PoseOf({500, 500, 0, 0});
  ASSERT_TRUE(Upload(std::move(far)).has_value());
  Tamper("data", "UPDATE keyframes SET blob = zeroblob(length(blob)) WHERE id = 1");
  Open(2);
  const RegionRequest request{RegionDisc{500'000'000, 500'000'000, 1'000'000}};
  // Its tiles are built although others cannot be.
  const auto wait = service_->WaitUntilClean(Long());
  ASSERT_TRUE(wait.has_value());
  EXPECT_EQ(wait->damage.code(), StatusCode::kInvalidData);
  EXPECT_GT(wait->dirty_tiles, 0u);
  auto query = service_->Query(request, {100, 64, [](const StoredTile&) {
                                           return 1u;
                                         }});
  EXPECT_TRUE(service_->NextTile(*query)->has_value());
}

TEST_F(AtlasTest, WaitsForADamagedKeyframeEndAndNameIt) {
  Open(1);
  UploadDrive(4);
  Digest();
  const TileId touched{0, -2, 0};
  const StoredTile before = store_->ReadTile(touched).value().value();
  Tamper("data", "UPDATE keyframes SET blob = zeroblob(length(blob)) WHERE id = 1");
  Open(2);
  const auto moved = Move({{DriveUpload(1).key, PoseOf({-4.0, 0.5, 1.8, 5.0})}});
  ASSERT_TRUE(moved.has_value());
  const auto wait = service_->WaitUntilClean(Long());
  ASSERT_TRUE(wait.has_value());
  EXPECT_FALSE(wait->is_timed_out);
  EXPECT_EQ(wait->damage.code(), StatusCode::kInvalidData);
  EXPECT_NE(wait->damage.message().find("bus/day/0"), std::string::npos) << wait->damage.message();
  EXPECT_EQ(service_->Digest(Long()).error(), wait->damage);
  EXPECT_EQ(service_->WaitForRevision(moved->revision, Long()), wait->damage);
  const auto status = service_->ReadStatus();
  EXPECT_GT(status->damaged_tiles, 0u);
  EXPECT_EQ(status->damaged_tiles, status->counts.dirty_tiles);
  EXPECT_EQ(store_->ReadTile(touched).value().value().blob, before.blob);
  const auto report = service_->Verify({.rebuild = true}, Long());
  ASSERT_TRUE(report.has_value()) << report.error().message();
  EXPECT_GT(report->damaged, 1u);  // the keyframe, and the tiles that cannot be rebuilt
  EXPECT_EQ(report->mismatched, 0u);
}

TEST_F(AtlasTest, TilesHealWhenTheDamagedKeyframeMovesAway) {
  Open(1);
  UploadDrive(4);
  Tamper("data", "UPDATE keyframes SET blob = zeroblob(length(blob)) WHERE id = 1");
  Open(1);
  ASSERT_TRUE(Move({{DriveUpload(1).key, PoseOf({-4.0, 0.5, 1.8, 5.0})}}).has_value());
  ASSERT_FALSE(service_->WaitUntilClean(Long())->damage.ok());
  ASSERT_TRUE(Move({{DriveUpload(0).key, PoseOf({900.0, 900.0, 0.0, 0.0})}}).has_value());
  const auto wait = service_->WaitUntilClean(Long());
  EXPECT_FALSE(wait->damage.ok());  // the tiles where it went
  const auto dirty = service_->ReadStatus()->counts.dirty_tiles;
  EXPECT_EQ(dirty, service_->ReadStatus()->damaged_tiles);
  EXPECT_TRUE(store_->ReadTile(TileId{0, -2, 0})->has_value());
}

TEST_F(AtlasTest, AParentOfADamagedTileWithADamagedKeyframeDoesNotWaitForIt) {
  Open(1);
  UploadDrive(4);
  Digest();
  Tamper("data",
         "UPDATE keyframes SET blob = zeroblob(length(blob)) WHERE id = 1;"
         "UPDATE tiles SET blob = zeroblob(length(blob)) WHERE key < (1 << 58)");
  Open(1);
  ASSERT_TRUE(Move({{DriveUpload(3).key, PoseOf({-1.0, 0.5, 1.8, 5.0})}}).has_value());
  const auto wait = service_->WaitUntilClean(Long());
  ASSERT_TRUE(wait.has_value());
  EXPECT_FALSE(wait->is_timed_out);
  EXPECT_EQ(wait->damage.code(), StatusCode::kInvalidData);
}

TEST_F(AtlasTest, ADamagedTileIsNeverServedAndHeals) {
  Open(1);
  UploadDrive(4);
  const AtlasDigest clean = Digest();
  Tamper("data", "UPDATE tiles SET blob = zeroblob(length(blob))");
  Open(1);
  RegionQuery::Options options{100, 64, [](const StoredTile&) {
                                 return 1u;
                               }};
  // Each query meets the next damaged tile; all of them are rebuilt in the end.
  for (std::uint64_t i = 0; i < 4 * clean.tiles; ++i) {
    auto query = service_->Query({}, options);
    auto tile = service_->NextTile(*query);
    while (tile && *tile) {
      tile = service_->NextTile(*query);
    }
    if (tile) {
      break;
    }
    ASSERT_EQ(tile.error().code(), StatusCode::kInvalidData);
    ASSERT_TRUE(service_->WaitUntilClean(Long()).has_value());
  }
  EXPECT_EQ(Digest().sha256, clean.sha256);
}

TEST_F(AtlasTest, WaitsEndWithTheService) {
  Open(0);
  UploadDrive(1);
  std::thread stopper([this] { service_->Stop(); });
  const auto wait = service_->WaitUntilClean(Long());
  stopper.join();
  ASSERT_FALSE(wait.has_value());
  EXPECT_EQ(wait.error().code(), StatusCode::kUnavailable);
}

TEST_F(AtlasTest, WaitForRevisionIsReadYourWrites) {
  Open(0);
  ASSERT_TRUE(Upload(DriveUpload(0)).has_value());
  EXPECT_EQ(service_->WaitForRevision(1, {}).code(), StatusCode::kTimeout);
  EXPECT_EQ(service_->WaitForRevision(99, Long()).code(), StatusCode::kInvalidArgument);
  Open(2);
  EXPECT_TRUE(service_->WaitForRevision(1, Long()).ok());
  EXPECT_TRUE(store_->ReadTile(TileId{0, -2, 0})->has_value());
}

}  // namespace
}  // namespace atlas
