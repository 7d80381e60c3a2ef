// Rows that are not what was written, under a running service: what it goes on serving, what heals
// by itself, by the vehicle, or by who repairs.
#include "server/service/verification/atlas_verify.h"
#include "tests/server/service/damage_fixture.h"
#include "tests/server/store/lost_rows.h"

namespace atlas {
namespace {

TEST_F(DamageTest, WhoSendsADamagedKeyframeAgainHealsIt) {
  Fill();
  const std::vector<TileId> footprint = store_->ReadKeyframe(4).value().footprint;
  Tamper(kSpoilBlob);
  EXPECT_EQ(Digest().sha256, intact_.sha256);  // nothing asks for it
  Mark(footprint);
  EXPECT_EQ(service_->Digest(Long()).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(Listed(), 1U);
  EXPECT_THAT(Events(), ::testing::ElementsAre(EventKind::kKeyframeDamaged));
  for (const TileId& tile : footprint) {
    EXPECT_TRUE(store_->ReadTile(tile));  // the last good content
  }
  const auto healed = Upload(DriveUpload(3));
  ASSERT_TRUE(healed) << healed.error().message();
  EXPECT_TRUE(healed->is_duplicate);
  EXPECT_EQ(healed->tiles_marked, footprint.size());
  EXPECT_EQ(Digest().sha256, intact_.sha256);
  EXPECT_EQ(Listed(), 0U);
  EXPECT_EQ(Events().back(), EventKind::kKeyframeHealed);
  const auto report = service_->Verify({.rebuild = true}, Long());
  EXPECT_EQ(report->damaged, 0U) << report->findings.at(0);
}

TEST_F(DamageTest, TheBytesOfABlobVouchForADamagedRow) {
  Fill();
  Tamper("UPDATE keyframes SET time_ms = time_ms + 1, radius_cells = 9 WHERE sequence = 3");
  ASSERT_TRUE(Upload(DriveUpload(3)));
  EXPECT_EQ(Digest().sha256, intact_.sha256);
  EXPECT_EQ(service_->Verify({.rebuild = true}, Long())->damaged, 0U);
}

TEST_F(DamageTest, OtherBytesHealNothing) {
  Fill();
  Tamper(kSpoilBlob);
  UploadRequest other = DriveUpload(3);
  other.blob = DriveUpload(4).blob;
  EXPECT_EQ(Upload(std::move(other)).error().code(), StatusCode::kConflict);
  Tamper("UPDATE keyframes SET time_ms = time_ms + 1 WHERE sequence = 3");  // nor does anything
  EXPECT_EQ(Upload(DriveUpload(3)).error().code(), StatusCode::kUnavailable)
      << "the vehicle keeps it";
}

TEST_F(DamageTest, WhatIsGivenUpWasNeverThere) {
  Fill();
  Tamper(kSpoilBlob);
  const auto found = service_->Verify({}, Long());
  EXPECT_EQ(found->damaged, 1U);
  EXPECT_EQ(Listed(), 1U);
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_EQ(repaired->given_up, 1U);
  EXPECT_EQ(Listed(), 0U);
  EXPECT_THAT(Events(), ::testing::Contains(EventKind::kKeyframeGivenUp));
  const AtlasDigest without = Digest();
  const auto report = service_->Verify({.rebuild = true}, Long());
  EXPECT_EQ(report->damaged, 0U) << report->findings.at(0);
  EXPECT_EQ(report->mismatched, 0U);
  EXPECT_EQ(without.sha256, DigestWithout(3).sha256);
  Open(1);
  const auto again = Upload(DriveUpload(3));
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_FALSE(again->is_duplicate);
  EXPECT_EQ(Digest().sha256, intact_.sha256);
}

TEST_F(DamageTest, WhatIsToldElsewhereIsRestored) {
  for (const char* damage :
       {"UPDATE poses SET x_um = x_um + 4096 WHERE keyframe_id = 4",
        "DELETE FROM poses WHERE keyframe_id = 4",
        "UPDATE pose_history SET z_um = 1 WHERE keyframe_id = 4",
        "UPDATE keyframe_tiles SET revision = revision + 1 WHERE keyframe_id = 4",
        "DELETE FROM keyframe_tiles WHERE keyframe_id = 4",
        "UPDATE keyframe_tiles SET tile_key = tile_key + 64 WHERE keyframe_id = 4",
        "UPDATE tiles SET payload_hash = 1", "UPDATE tiles SET blob = zeroblob(blob_bytes)",
        "DELETE FROM tiles WHERE key % 3 = 0", "DELETE FROM tiles",
        "DELETE FROM tiles WHERE key >> 58 = 2", "UPDATE sessions SET state = 3",
        "DELETE FROM session_states", "DELETE FROM session_states; UPDATE sessions SET state = 3",
        "UPDATE sessions SET last_sequence = 1", "UPDATE counters SET value = value + 1",
        "DELETE FROM counters", "UPDATE dirty_tiles SET since = 1",
        "DROP INDEX changes_of_tile; CREATE INDEX changes_of_tile ON keyframe_tiles "
        "(tile_key, revision, keyframe_id, is_current, checksum) WHERE keyframe_id <> 4"}) {
    SCOPED_TRACE(damage);
    Fill();
    Tamper(damage);
    const auto repaired = Repair();
    ASSERT_TRUE(repaired) << repaired.error().message();
    EXPECT_EQ(repaired->given_up, 0U);
    EXPECT_EQ(Digest().sha256, intact_.sha256);
    const auto report = service_->Verify({.rebuild = true}, Long());
    EXPECT_EQ(report->damaged, 0U) << report->findings.at(0);
    EXPECT_EQ(report->mismatched, 0U) << report->findings.at(0);
    Close();
    std::filesystem::remove_all(directory_ / "data");
  }
}

// Of some rows of a keyframe the others are no keyframe; of none nobody knows.
class VanishedRowsTest : public DamageTest, public ::testing::WithParamInterface<bool> {};

TEST_P(VanishedRowsTest, AKeyframeWhoseRowsAreGoneWasNeverThere) {
  const bool is_rebuilt = GetParam();
  for (const char* damage :
       {"DELETE FROM keyframes WHERE id = 4",
        "DELETE FROM keyframes WHERE id = 4; DELETE FROM poses WHERE keyframe_id = 4",
        "DELETE FROM keyframes WHERE id = 4; DELETE FROM keyframe_tiles WHERE keyframe_id = 4",
        "DELETE FROM keyframes WHERE id = 4; DELETE FROM poses WHERE keyframe_id = 4;"
        "DELETE FROM pose_history WHERE keyframe_id = 4;"
        "DELETE FROM keyframe_tiles WHERE keyframe_id = 4"}) {
    SCOPED_TRACE(damage);
    surveys_ = {100'000, 100'000};  // which know of it
    Fill();
    const AtlasDigest without = DigestWithout(3);
    Open(1);
    Tamper(damage);
    EXPECT_GT(service_->Verify({}, Long())->damaged, 0U);
    ASSERT_TRUE(service_->Verify({.rebuild = is_rebuilt, .repair = true, .author = "who"}, Long()));
    EXPECT_EQ(Digest().sha256, without.sha256);
    EXPECT_FALSE(service_->DigestAt(2, Long())) << "nobody knows what it was";
    const auto report = service_->Verify({.rebuild = true}, Long());
    EXPECT_EQ(report->damaged + report->mismatched, 0U) << report->findings.at(0);
    ASSERT_TRUE(Upload(DriveUpload(3)));
    EXPECT_EQ(Digest().sha256, intact_.sha256);
    Close();
    std::filesystem::remove_all(directory_ / "data");
    std::filesystem::remove_all(directory_ / "reference");
  }
}

INSTANTIATE_TEST_SUITE_P(Rebuilt, VanishedRowsTest, ::testing::Bool());

// It may have been retracted.
TEST_F(DamageTest, ASessionOfWhichNothingTellsIsInQuarantine) {
  for (const char* damage :
       {"DELETE FROM sessions; DELETE FROM session_states",
        "DELETE FROM session_states; UPDATE sessions SET vehicle = 'tram', state = 3"}) {
    SCOPED_TRACE(damage);
    Fill();
    Tamper(damage);
    ASSERT_TRUE(Repair());
    const auto sessions = store_->ListSessions({}, 10).value();
    ASSERT_EQ(sessions.size(), 1U);
    EXPECT_EQ(sessions[0].state, SessionState::kQuarantined);
    EXPECT_EQ(Digest().tiles, 0U);
    const auto report = service_->Verify({.rebuild = true}, Long());
    EXPECT_EQ(report->damaged + report->mismatched, 0U) << report->findings.at(0);
    const auto released = Change(sessions[0].key, SessionAction::kRelease);
    ASSERT_TRUE(released) << released.error().message();
    EXPECT_EQ(Digest().tiles, intact_.tiles);
    Close();
    std::filesystem::remove_all(directory_ / "data");
  }
}

TEST_F(DamageTest, ASessionWithoutItsRowGetsAName) {
  Fill();
  Tamper("DELETE FROM sessions");
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_EQ(repaired->given_up, 0U);
  const auto sessions = store_->ListSessions({}, 10).value();
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].key, (SessionKey{"lost", "session-1"}));
  EXPECT_EQ(sessions[0].keyframes, kDrive);
  EXPECT_THAT(Events(), ::testing::Contains(EventKind::kTablesRepaired));
  EXPECT_EQ(Digest().tiles, intact_.tiles);
  const auto report = service_->Verify({.rebuild = true}, Long());
  EXPECT_EQ(report->damaged + report->mismatched, 0U) << report->findings.at(0);
}

// It may be another one's name, and what keyframes make of a tile goes by it.
TEST_F(DamageTest, TilesOfASessionForWhoseNameNothingVouchesAreBuiltAgain) {
  Fill();
  Tamper("UPDATE sessions SET vehicle = 'tram'");
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_THAT(Events(), ::testing::Contains(EventKind::kTablesRepaired));
  EXPECT_EQ(Digest().tiles, intact_.tiles);
  const auto report = service_->Verify({.rebuild = true}, Long());
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->damaged + report->mismatched, 0U) << report->findings.at(0);
}

TEST_F(DamageTest, ASessionWithoutItsHistoryIsRetractedAndRestored) {
  Fill();
  Tamper("DELETE FROM session_states");
  ASSERT_TRUE(Change("day", SessionAction::kRetract));
  EXPECT_EQ(Change("day", SessionAction::kRestore).error().code(), StatusCode::kInvalidData);
  ASSERT_TRUE(Repair());
  const auto report = service_->Verify({}, Long());
  EXPECT_EQ(report->damaged, 0U) << report->findings.at(0);
  ASSERT_TRUE(Change("day", SessionAction::kRestore));
  EXPECT_EQ(Digest().sha256, intact_.sha256);
}

TEST_F(DamageTest, WhatIsPurgedWhileItIsVerifiedIsNoDamage) {
  Fill();
  ASSERT_TRUE(Upload(DriveUpload(0, "night")));
  Digest();
  AtlasVerifier::Options options;
  int calls = 0;
  options.check_stop = [&] {
    if (++calls == 3) {  // after both sessions: keyframes are listed, and the first is to be read
      EXPECT_TRUE(Change("day", SessionAction::kPurge));
    }
    return Status();
  };
  const auto report = AtlasVerifier(*store_, options).Run();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_GT(calls, 3);
  EXPECT_EQ(report->damaged, 0U) << report->findings.at(0);
}

TEST_F(DamageTest, ATileThatIsListedAndNotFoundIsBuiltAgainForWhoAsks) {
  Fill();
  const TileId tile = store_->ListTiles(-1, 1)->at(0).id;
  Tamper(testing::LoseTiles("key = " + std::to_string(tile.Key())));
  EXPECT_EQ(service_->Digest(Long()).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(service_->ReadTile(tile).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(Digest().sha256, intact_.sha256);
  EXPECT_TRUE(service_->ReadTile(tile)->has_value());
  const auto report = service_->Verify({.rebuild = true}, Long());
  EXPECT_EQ(report->damaged, 0U) << report->findings.at(0);
}

TEST_F(DamageTest, ATileThatIsListedAndNotFoundIsBuiltAgainForItsParent) {
  Fill();
  const TileId tile = store_->ListTiles(-1, 1)->at(0).id;
  Tamper(testing::LoseTiles("key = " + std::to_string(tile.Key())));
  Mark({tile.Parent()});
  EXPECT_EQ(Digest().sha256, intact_.sha256);
}

// Whole, with its checksum: no index tells where it was.
TEST_F(DamageTest, ATileUnderTheKeyOfAnotherPlaceIsBuiltAgainAtBoth) {
  Fill();
  const auto tiles = store_->ListTiles(-1, 2).value();
  Close();
  SqliteStoreOptions options;
  options.directory = directory_ / "data";
  auto opened = OpenSqliteStore(options);
  ASSERT_TRUE(opened);
  const StoredTile tile = (*opened)->ReadTile(tiles[0].id).value().value();
  ASSERT_TRUE(Await<std::uint32_t>([&](auto done) {
    (*opened)->MarkDirty({tiles[0].id, {0, 500, 500}}, std::move(done));
  }));
  const auto claims = Await<ClaimResult>([&](auto done) {
    (*opened)->ClaimDirty({"hand", 1, 60'000, 100, 1U << 30}, std::move(done));
  });
  for (const TileClaim& claim : claims->claims) {
    const bool is_here = claim.id == tiles[0].id;
    ASSERT_TRUE(Await<FinishResult>([&](auto done) {
      (*opened)->FinishTile(
          {claim, 1,
           is_here ? std::nullopt : std::optional(TileContent{tile.blob, tile.payload_hash, 1, 0})},
          std::move(done));
    }));
  }
  opened->reset();
  Tamper("DELETE FROM dirty_tiles");
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_EQ(Digest().sha256, intact_.sha256);
  EXPECT_FALSE(store_->ReadTile({0, 500, 500})->has_value());
}

// One that is damaged, and cannot be fused, and one that is missing: each look marks the first
// again.
TEST_F(DamageTest, AVerificationEndsWhereATileCannotBeFused) {
  Fill();
  const TileId stuck = store_->ReadKeyframe(4)->footprint.front();
  const auto tiles = store_->ListTiles(-1, 1'000).value();
  const auto missing = std::find_if(tiles.rbegin(), tiles.rend(),
                                    [](const TileSummary& tile) { return tile.id.level == 0; });
  Tamper(std::string(kSpoilBlob) + ";UPDATE tiles SET blob = zeroblob(blob_bytes) WHERE key = " +
         std::to_string(stuck.Key()) +
         ";DELETE FROM tiles WHERE key = " + std::to_string(missing->id.Key()));
  const auto report = service_->Verify({.rebuild = true}, {std::chrono::seconds(30), {}});
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_GT(report->damaged, 0U);
  EXPECT_GT(report->mismatched, 0U);
}

TEST_F(DamageTest, TilesThatAreListedAndNotFoundAreRepaired) {
  Fill();
  Tamper(testing::LoseTiles("key % 3 = 0"));
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_GT(repaired->restored, 0U);
  EXPECT_EQ(Digest().sha256, intact_.sha256);
  const auto report = service_->Verify({.rebuild = true}, Long());
  EXPECT_EQ(report->damaged, 0U) << report->findings.at(0);
}

TEST_F(DamageTest, AnIndexThatIsGoneIsNamedAndMadeAnew) {
  for (const std::string index : {"tile_summaries", "changes_of_tile", "tiles_of_keyframe",
                                  "quarantined_sessions", "tombstones_of_compaction"}) {
    SCOPED_TRACE(index);
    Fill();
    Tamper("DROP INDEX " + index);
    const auto damaged = service_->Verify({}, Long());
    ASSERT_TRUE(damaged) << damaged.error().message();
    EXPECT_GT(damaged->damaged, 0U);
    EXPECT_THAT(damaged->findings,
                ::testing::Contains(::testing::HasSubstr("the index " + index + " is missing; ")));
    if (index == "tile_summaries") {
      EXPECT_EQ(service_->Digest(Long()).error().code(), StatusCode::kInvalidData);
    }
    const auto repaired = Repair();
    ASSERT_TRUE(repaired) << repaired.error().message();
    EXPECT_EQ(repaired->restored, 1U);
    const auto report = service_->Verify({.rebuild = true}, Long());
    EXPECT_EQ(report->damaged + report->mismatched, 0U) << report->findings.at(0);
    EXPECT_EQ(Digest().sha256, intact_.sha256);
    Close();
    std::filesystem::remove_all(directory_ / "data");
  }
}

TEST_F(DamageTest, APoseComesBackFromItsHistoryByItself) {
  Fill();
  Tamper("UPDATE poses SET x_um = x_um + 4096 WHERE keyframe_id = 4");
  Mark({{0, 0, 0}});
  std::vector<TileId> tiles;
  ASSERT_TRUE(store_->ScanFootprintTiles({0}, [&](const TileId& id) { tiles.push_back(id); }).ok());
  Mark(tiles);
  EXPECT_EQ(Digest().sha256, intact_.sha256);
  EXPECT_EQ(Listed(), 0U);
  EXPECT_THAT(Events(), ::testing::Contains(EventKind::kKeyframeHealed));
}

TEST_F(DamageTest, NoRevisionIsGivenTwiceAfterItsCounterWasLost) {
  Fill();
  const std::uint64_t revision = store_->revision();
  Tamper("UPDATE counters SET value = 1 WHERE name = 'revision'");
  EXPECT_GT(store_->revision(), revision);
  EXPECT_THAT(Events(), ::testing::ElementsAre(EventKind::kCountersRestored));
  EXPECT_EQ(Digest().sha256, intact_.sha256);
}

TEST_F(DamageTest, LostMarksAreSetAgain) {
  Open(0);
  UploadDrive(kDrive);
  Tamper("DELETE FROM dirty_tiles WHERE key % 2 = 0");
  const AtlasDigest digest = Digest();
  EXPECT_THAT(Events(), ::testing::Contains(EventKind::kMarksRestored));
  Close();
  std::filesystem::remove_all(directory_ / "data");
  Fill();
  EXPECT_EQ(digest.sha256, intact_.sha256);
}

}  // namespace
}  // namespace atlas
