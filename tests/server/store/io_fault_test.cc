// A store whose disk fails at any one of its calls, once or from then on: what was acknowledged is
// there after the next opening, nothing is there in half, and what was refused can be done then.
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/store/io_fault_fixture.h"

namespace atlas {
namespace {

const TileId kA{0, 0, 0};
const TileId kB{0, 1, 0};

// What the store said that it has. A change that was refused may have come to the disk all the
// same, or not; the next one that is acknowledged settles it.
struct Ledger {
  std::map<std::uint32_t, std::set<std::int64_t>> x_um;  // of keyframes that must be there
  std::set<std::uint32_t> tried;                         // those that may be
  std::set<SessionState> states = {SessionState::kLive};
  std::set<TileId> to_be_fused;  // tiles that must be marked
  std::uint64_t revision = 0;
};

class IoFaultTest : public IoFaultFixture {
 protected:
  void Prepare() override {
    ledger_ = Ledger();
    fused_.reset();
  }
  void TryPut(std::uint32_t sequence, const std::vector<TileId>& footprint) {
    ledger_.tried.insert(sequence);
    const auto put = Put(Large(sequence, footprint));
    if (put) {
      // A duplicate may have been moved before: only its own change tells where it is.
      ledger_.x_um[sequence].insert(0);
      ledger_.to_be_fused.insert(footprint.begin(), footprint.end());
      Acknowledged(put->revision);
    }
  }
  void TryMove(std::uint32_t sequence, std::int64_t x_um, const std::vector<TileId>& footprint) {
    const auto moved = Update({{{{"bus", "day"}, sequence}, PoseAt(x_um), footprint}});
    if (moved) {
      ledger_.x_um[sequence] = {x_um};
      ledger_.to_be_fused.insert(footprint.begin(), footprint.end());
      Acknowledged(moved->revision);
    } else if (const auto known = ledger_.x_um.find(sequence); known != ledger_.x_um.end()) {
      known->second.insert(x_um);
    }
  }
  void TryChange(SessionAction action) {
    const SessionState after =
        action == SessionAction::kRetract ? SessionState::kRetracted : SessionState::kLive;
    const auto changed = Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({{"bus", "day"}, action, "tester", ""}, std::move(done));
    });
    if (changed) {
      ledger_.states = {after};
      Acknowledged(changed->revision);
    } else {
      ledger_.states.insert(after);
    }
  }
  void TryFuse() {
    const auto claimed = Await<ClaimResult>([&](auto done) {
      store_->ClaimDirty({"w", 1'000, 60'000, 1, 1U << 30U}, std::move(done));
    });
    if (!claimed || claimed->claims.empty()) {
      return;
    }
    const TileClaim& claim = claimed->claims[0];
    ledger_.to_be_fused.erase(claim.id);  // whatever comes of it: it may be done
    const auto finished = Finish(claim, Content(7));
    if (finished) {
      fused_ = claim.id;
    }
  }
  void Acknowledged(std::uint64_t revision) {
    EXPECT_GE(revision, ledger_.revision);
    ledger_.revision = revision;
  }

  // A little of everything, with two openings.
  void Live() override {
    if (!TryOpen()) {
      return;
    }
    TryPut(1, {kA});
    TryPut(2, {kA, kB});
    TryFuse();
    TryMove(2, 700'000, {kB});
    TryChange(SessionAction::kRetract);
    TryChange(SessionAction::kRestore);
    if (!TryOpen()) {
      return;
    }
    TryPut(3, {kB});
    TryMove(1, 300'000, {kA});
    store_->Flush();
    store_.reset();
  }

  // Of the store after its next opening, on a disk that works.
  void ExpectAllThere() override {
    ASSERT_TRUE(TryOpen());
    const Status counted = store_->CheckCounters();
    EXPECT_TRUE(counted.ok()) << counted.message();
    const auto counts = store_->ReadCounts();
    ASSERT_TRUE(counts.has_value()) << counts.error().message();
    EXPECT_GE(counts->revision, ledger_.revision);
    EXPECT_EQ(store_->identity().epoch, 1U) << "commits are said to be missing";
    EXPECT_GE(counts->keyframes, ledger_.x_um.size());
    EXPECT_LE(counts->keyframes, ledger_.tried.size());
    for (const auto& [sequence, places] : ledger_.x_um) {
      const KeyframeKey key{{"bus", "day"}, sequence};
      const auto found = store_->FindKeyframes(std::vector<KeyframeKey>{key});
      ASSERT_TRUE(found.has_value()) << found.error().message();
      EXPECT_TRUE(places.contains(found->at(0)->pose.x_um)) << found->at(0)->pose.x_um;
      const auto blob = store_->ReadKeyframeBlob(found->at(0)->id);
      ASSERT_TRUE(blob.has_value()) << blob.error().message();
      EXPECT_EQ(*blob, Large(sequence, {}).blob);
      EXPECT_TRUE(store_->ReadKeyframe(found->at(0)->id).has_value());
    }
    if (const auto session = store_->FindSession({"bus", "day"}); session && *session) {
      EXPECT_TRUE(ledger_.states.contains((*session)->state));
      EXPECT_TRUE(store_->CheckSession({"bus", "day"}).ok());
    }
    std::set<TileId> marked;
    for (const TileClaim& claim : Claim().claims) {
      marked.insert(claim.id);
    }
    for (const TileId& id : ledger_.to_be_fused) {
      EXPECT_TRUE(marked.contains(id)) << id << " would never be fused";
    }
    if (fused_) {
      const auto tile = store_->ReadTile(*fused_);
      ASSERT_TRUE(tile.has_value()) << tile.error().message();
      EXPECT_TRUE(tile->has_value());
    }
    // And it goes on.
    for (const std::uint32_t sequence : {1U, 2U, 3U, 4U}) {
      const auto put = Put(Large(sequence, {kA}));
      EXPECT_TRUE(put.has_value()) << sequence << ": " << put.error().message();
    }
    EXPECT_EQ(store_->ReadCounts()->keyframes, 4U);
  }

 private:
  Ledger ledger_;
  std::optional<TileId> fused_;
};

TEST_F(IoFaultTest, ThePowerIsCutAtAnyCallAndNothingUnsyncedIsThere) {
  EXPECT_GT(CutPowerAtEach(Loss::kAll), 300U);
}

TEST_F(IoFaultTest, ThePowerIsCutAtAnyCallAndSomeOfTheUnsyncedIsThere) {
  EXPECT_GT(CutPowerAtEach(Loss::kSome), 300U);
}

TEST_F(IoFaultTest, ThePowerIsCutAtAnyCallAndWritesAreTorn) {
  EXPECT_GT(CutPowerAtEach(Loss::kSectors), 300U);
}

TEST_F(IoFaultTest, AnyCallFailsOnce) {
  EXPECT_GT(FailEach(Calls::kAll, Until::kOnce), 300U);
}

TEST_F(IoFaultTest, AnyCallAndAllBehindItFail) {
  EXPECT_GT(FailEach(Calls::kAll, Until::kHealed), 300U);
}

TEST_F(IoFaultTest, AnySyncFailsOnce) {
  EXPECT_GT(FailEach(Calls::kSync, Until::kOnce), 10U);
}

// A second sync that succeeds says nothing of what the first one lost.
TEST_F(IoFaultTest, AfterAFailedSyncNothingIsWrittenUntilItIsOpenedAgain) {
  std::vector<Status> told;
  options_.on_failed_sync = [&told](const Status& why) {
    told.push_back(why);
  };
  ASSERT_TRUE(TryOpen());
  ASSERT_TRUE(Put(Large(1, {kA})).has_value());
  FailSyncs(1);
  const auto refused = Put(Large(2, {kA}));
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), StatusCode::kUnavailable);
  for (const std::uint32_t sequence : {1U, 2U, 3U}) {  // one that is there, too
    const auto put = Put(Large(sequence, {kA}));
    ASSERT_FALSE(put.has_value()) << sequence;
    EXPECT_NE(put.error().message().find("failed to sync"), std::string::npos);
  }
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code(), StatusCode::kUnavailable);
  ASSERT_TRUE(store_->ReadWriteFigures().last_refusal.has_value()) << "the daemon is not ready";
  EXPECT_EQ(store_->ReadCounts()->keyframes, 1U) << "what was there can be read";
  ASSERT_TRUE(TryOpen());
  EXPECT_TRUE(Put(Large(2, {kA})).has_value());
}

// Found by AnyCallAndAllBehindItFail: a change whose sync failed may be in the log; who was told
// meanwhile that there is nothing to undo would find it done after the next start.
TEST_F(IoFaultTest, NobodyIsToldOfAStateThatTheNextStartMayNotHave) {
  ASSERT_TRUE(TryOpen());
  ASSERT_TRUE(Put(Large(1, {kA})).has_value());
  FailSyncs(1);
  TryChange(SessionAction::kRetract);
  const auto restored = Await<SessionChangeResult>([&](auto done) {
    store_->ChangeSession({{"bus", "day"}, SessionAction::kRestore, "tester", ""}, std::move(done));
  });
  EXPECT_FALSE(restored.has_value());
}

// What a failed sync left is read from memory after a kill, as if it was on disk, and what comes
// behind it is acknowledged: the hole must not be there when the power goes.
TEST_F(IoFaultTest, AFailedSyncAKillAndAPowerCutLoseNothingAcknowledged) {
  ASSERT_TRUE(TryOpen());
  TryPut(1, {kA});
  FailSyncs(1);
  TryPut(2, {kA, kB});
  Kill();
  ASSERT_TRUE(TryOpen());
  TryPut(2, {kA, kB});
  TryPut(3, {kB});
  CutPower();
  ExpectAllThere();
}

TEST_F(IoFaultTest, TheDiskIsFullFromAnyWriteOn) {
  EXPECT_GT(FailEach(Calls::kWrite, Until::kHealed, true), 200U);
}

}  // namespace
}  // namespace atlas
