// The atlas as of earlier revisions: what is read back is what was there, byte for byte.
#include <map>
#include <set>

#include <sqlite3.h>

#include "core/base/bytes.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "server/service/history/past_view.h"
#include "tests/core/support/test_scale.h"
#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

const std::vector<std::string> kSessions = {"day", "night", "rain"};
constexpr std::uint32_t kKeyframes = 5;  // a session at most

// Payload hashes by tile.
using Content = std::map<TileId, std::uint64_t>;

class HistoryTest : public ServiceTest {
 protected:
  Content Everything(const RegionRequest& request) {
    auto query = service_->Query(request,
                                 {100, 64,
                                  [](const StoredTile&) {
                                    return 1u;
                                  }},
                                 Long());
    EXPECT_TRUE(query.has_value()) << query.error().message();
    Content content;
    for (auto tile = service_->NextTile(*query); tile.value(); tile = service_->NextTile(*query)) {
      content[(*tile)->id] = (*tile)->payload_hash;
      EXPECT_TRUE(!request.at_revision || (*tile)->revision == *request.at_revision);
    }
    return content;
  }
  Content EverythingAt(std::uint64_t revision) {
    RegionRequest request;
    request.at_revision = revision;
    return Everything(request);
  }
  void Tamper(const std::string& sql) {
    Close();
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((directory_ / "data" / "atlas.db").c_str(), &db), SQLITE_OK);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }
};

// A world that changes at random, and what it was whenever it was clean.
class RandomWorld {
 public:
  struct Moment {
    std::uint64_t revision = 0;
    AtlasDigest digest;
  };

  explicit RandomWorld(std::uint32_t seed) : random_(seed) {}

  std::uint32_t Draw(std::uint32_t below) { return static_cast<std::uint32_t>(random_() % below); }
  testing::MapPose SomePose() {
    return {Draw(200) / 10.0 - 10.0, Draw(120) / 10.0 - 6.0, 1.8 + Draw(10) / 10.0,
            1.0 * Draw(360)};
  }
  UploadRequest NextUpload() {
    const std::string& session = kSessions[Draw(3)];
    const std::uint32_t i = Draw(kKeyframes);
    UploadRequest request = DriveUpload(i, session);
    const auto known = poses.find(request.key);
    request.pose = known == poses.end() ? PoseOf(SomePose()) : known->second;
    poses.emplace(request.key, request.pose);
    return request;
  }
  std::vector<PoseBatchRequest::Update> NextMoves() {
    std::vector<PoseBatchRequest::Update> moves;
    for (auto& [key, pose] : poses) {
      if (Draw(3) == 0) {
        pose = PoseOf(SomePose());
        moves.push_back({key, pose});
      }
    }
    return moves;
  }

  std::map<KeyframeKey, QuantizedPose> poses;
  std::set<std::string> retracted;
  std::vector<Moment> moments;

 private:
  std::mt19937 random_;
};

class HistoryPropertyTest : public HistoryTest {
 protected:
  void Step(RandomWorld& world) {
    const std::uint32_t what = world.Draw(10);
    if (what < 5) {
      ASSERT_TRUE(Upload(world.NextUpload()).has_value());
    } else if (what < 7) {
      ASSERT_TRUE(Move(world.NextMoves()).has_value());
    } else {
      const std::string& session = kSessions[world.Draw(3)];
      const bool is_retraction = world.Draw(2) == 0;
      const auto changed =
          Change(session, is_retraction ? SessionAction::kRetract : SessionAction::kRestore);
      if (changed && is_retraction) {
        world.retracted.insert(session);
      } else if (changed) {
        world.retracted.erase(session);
      }
    }
  }
  void Remember(RandomWorld& world) {
    const AtlasDigest digest = Digest();
    world.moments.push_back({digest.revision, digest});
  }
  // An atlas that never saw what is retracted now.
  AtlasDigest WithoutTheRetracted(const RandomWorld& world) {
    Open(2, "reference");
    for (const auto& [key, pose] : world.poses) {
      if (!world.retracted.contains(key.session.session)) {
        UploadRequest request = DriveUpload(key.sequence, key.session.session);
        request.pose = pose;
        EXPECT_TRUE(Upload(std::move(request)).has_value());
      }
    }
    const AtlasDigest digest = Digest();
    Close();
    std::filesystem::remove_all(directory_ / "reference");
    return digest;
  }
};

TEST_F(HistoryPropertyTest, EveryRevisionIsReadBackAsItWas) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(5); ++seed) {
    SCOPED_TRACE(seed);
    const std::string name = "world" + std::to_string(seed);
    RandomWorld world(seed);
    Open(2, name);
    for (int step = 0; step < 14; ++step) {
      Step(world);
      if (world.Draw(2) == 0) {
        Remember(world);
      }
      if (world.Draw(6) == 0) {
        Open(1 + world.Draw(3), name);
      }
    }
    Remember(world);
    for (const RandomWorld::Moment& moment : world.moments) {
      const AtlasDigest past = DigestAt(moment.revision);
      EXPECT_EQ(past.sha256, moment.digest.sha256) << "revision " << moment.revision;
      EXPECT_EQ(past.tiles, moment.digest.tiles);
      EXPECT_EQ(past.revision, moment.revision);
    }
    EXPECT_EQ(WithoutTheRetracted(world).sha256, world.moments.back().digest.sha256);
  }
}

TEST_F(HistoryTest, QueriesOfThePastSendWhatWasThere) {
  Open();
  UploadDrive(4);
  const std::uint64_t before = Digest().revision;
  const Content was = Everything({});
  RegionRequest near{RegionDisc{-2'000'000, 500'000, 4'000'000}, 0, 2};
  const Content near_was = Everything(near);
  ASSERT_GT(near_was.size(), 4u);
  ASSERT_TRUE(Move({{DriveUpload(1).key, PoseOf({30.0, 40.0, 1.8, 5.0})}}).has_value());
  ASSERT_TRUE(Upload(DriveUpload(9)).has_value());
  const std::uint64_t after = Digest().revision;
  EXPECT_EQ(EverythingAt(before), was);
  EXPECT_EQ(EverythingAt(after), Everything({}));
  EXPECT_TRUE(EverythingAt(0).empty());
  near.at_revision = before;
  EXPECT_EQ(Everything(near), near_was);
}

TEST_F(HistoryTest, ARevisionBeforeFusionShowsItsKeyframesFused) {
  Open(0);
  UploadDrive(3);
  EXPECT_EQ(service_->ReadStatus()->counts.tiles, 0u);
  const AtlasDigest unfused = DigestAt(3);
  const AtlasDigest two = DigestAt(2);
  Open(2);
  EXPECT_EQ(Digest().sha256, unfused.sha256);
  EXPECT_EQ(DigestAt(2).sha256, two.sha256);
  EXPECT_NE(two.sha256, unfused.sha256);
}

TEST_F(HistoryPropertyTest, ThePastStandsStillWhileThePresentMoves) {
  RandomWorld world(77);
  Open(2);
  for (int step = 0; step < 8; ++step) {
    Step(world);
  }
  const AtlasDigest was = Digest();
  const Content tiles = Everything({});
  std::jthread present([this, &world](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      Step(world);
    }
  });
  for (std::uint32_t i = 0; i < testing::Scaled(4); ++i) {
    EXPECT_EQ(DigestAt(was.revision).sha256, was.sha256);
    EXPECT_EQ(EverythingAt(was.revision), tiles);
  }
}

TEST_F(HistoryTest, WhatIsKeptSavesWorkAndChangesNothing) {
  Open();
  UploadDrive(4);
  const std::uint64_t revision = Digest().revision;
  const Content expected = Everything({});
  std::vector<int> looks;
  for (const std::size_t max_kept_bytes :
       {std::size_t{0}, std::size_t{3'000}, std::size_t{1} << 20}) {
    looks.push_back(0);
    const auto look = [&looks] {
      ++looks.back();
      return Status();
    };
    PastView view(*store_, {revision, std::make_shared<KeyframeCache>(0), look}, {},
                  max_kept_bytes);
    Content content;
    for (int level = TestProfile().levels - 1; level >= 0; --level) {
      ASSERT_TRUE(view.Scan({static_cast<std::uint8_t>(level)},
                            [&](const TileId& id) {
                              const auto tile = view.Read(id);
                              ASSERT_TRUE(tile.has_value());
                              if (*tile) {
                                content[id] = (*tile)->payload_hash;
                              }
                            })
                      .ok());
    }
    EXPECT_EQ(content, expected);
  }
  EXPECT_GT(looks[0], looks[1]);
  EXPECT_GT(looks[1], looks[2]);
  EXPECT_GT(looks[0], 3 * looks[2]);  // each level-0 tile once instead of once a level
}

TEST_F(HistoryTest, RevisionsThatAreNotThereAreRefused) {
  Open();
  UploadDrive(1);
  const std::uint64_t revision = Digest().revision;
  const auto refusal = [&](std::uint64_t at) {
    RegionRequest request;
    request.at_revision = at;
    const auto query = service_->Query(request, {100, 64, nullptr}, Long());
    const auto digest = service_->DigestAt(at, Long());
    EXPECT_FALSE(query.has_value() || digest.has_value());
    EXPECT_EQ(query.error(), digest.error());
    return digest.error().code();
  };
  EXPECT_EQ(refusal(revision + 1), StatusCode::kInvalidArgument);
  EXPECT_EQ(refusal(UINT64_MAX), StatusCode::kInvalidArgument);
  EXPECT_EQ(DigestAt(0).tiles, 0u);
  ByteWriter horizon;  // as a compaction would leave it
  horizon.U8(12);
  horizon.I64(11);
  horizon.U64(1);
  Tamper(StrCat("UPDATE counters SET value = 1, checksum = ",
                static_cast<std::int64_t>(Hash64(horizon.bytes())),
                " WHERE name = 'history_horizon'"));
  Open();
  EXPECT_EQ(refusal(0), StatusCode::kNotFound);
}

TEST_F(HistoryTest, WorkOnThePastEndsInTimeAndWithTheService) {
  Open();
  UploadDrive(2);
  const std::uint64_t revision = Digest().revision;
  EXPECT_EQ(service_->DigestAt(revision, {}).error().code(), StatusCode::kTimeout);
  std::stop_source gone;
  gone.request_stop();
  EXPECT_EQ(service_->DigestAt(revision, {Long().deadline, gone.get_token()}).error().code(),
            StatusCode::kUnavailable);
  RegionRequest request;
  request.at_revision = revision;
  auto query = service_->Query(request,
                               {100, 64,
                                [](const StoredTile&) {
                                  return 1u;
                                }},
                               Long());
  service_->EndWaits();
  EXPECT_EQ(service_->NextTile(*query).error().code(), StatusCode::kUnavailable);
  EXPECT_EQ(service_->DigestAt(revision, Long()).error().code(), StatusCode::kUnavailable);
}

TEST_F(HistoryTest, DamageInThePastIsNamedAndMarksNothing) {
  Open();
  UploadDrive(2);
  const AtlasDigest clean = Digest();
  ASSERT_TRUE(Move({{DriveUpload(1).key, PoseOf({-4.0, 0.5, 1.8, 5.0})}}).has_value());
  Digest();
  Tamper("UPDATE pose_history SET x_um = x_um + 1 WHERE revision = 1");
  Open();
  const auto digest = service_->DigestAt(clean.revision, Long());
  ASSERT_FALSE(digest.has_value());
  EXPECT_EQ(digest.error().code(), StatusCode::kInvalidData);
  RegionRequest request;
  request.at_revision = clean.revision;
  auto query = service_->Query(request,
                               {100, 64,
                                [](const StoredTile&) {
                                  return 1u;
                                }},
                               Long());
  EXPECT_EQ(service_->NextTile(*query).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(service_->ReadStatus()->counts.dirty_tiles, 0u);
  EXPECT_EQ(service_->Verify({}, Long())->damaged, 1u);
}

}  // namespace
}  // namespace atlas
