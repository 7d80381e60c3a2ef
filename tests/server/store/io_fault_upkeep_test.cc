// An atlas that is looked after while its disk fails: damage is found and repaired, keyframes are
// dropped, rules of fusion change, a session is quarantined and released, another is purged.
#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/server/store/io_fault_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

const TileId kA{0, 0, 0};
const TileId kB{0, 1, 0};
const TileId kC{0, 2, 0};
const SessionKey kDay{"bus", "day"};      // of what is dropped and what is damaged
const SessionKey kNight{"bus", "night"};  // to be purged
const SessionKey kOld{"bus", "old"};      // its row is damaged
const SessionKey kWild{"bus", "jump"};    // begins far from where it goes on

// Of keyframes, in the order of their upload.
constexpr std::int64_t kDropped = 1;
constexpr std::int64_t kSentAgain = 2;
constexpr std::int64_t kGivenUp = 3;
constexpr std::int64_t kMoved = 4;
constexpr std::int64_t kPurged = 5;

constexpr std::uint64_t kNewRules = 2;

// What the store says that it did. What it refuses may come to the disk all the same, or not.
enum class Step {
  kRows,
  kNote,
  kSendAgain,
  kRestore,
  kGiveUp,
  kSums,
  kCompact,
  kJump,
  kRelease,
  kPurge,
  kRules
};

class UpkeepFaultTest : public IoFaultFixture {
 protected:
  // A long life: with ATLAS_TEST_SCALE=3 it is ended at each call.
  UpkeepFaultTest() : IoFaultFixture(testing::Stride(3)) {}

  static NewKeyframe KeyframeOf(const SessionKey& session,
                                std::uint32_t sequence,
                                const TileId& tile) {
    NewKeyframe keyframe = Large(sequence, {tile});
    keyframe.key.session = session;
    keyframe.blob.resize(10'000);
    if (session == kWild) {
      keyframe.pose = PoseAt(5'000'000'000 * sequence);
      keyframe.limits = PlausibilityLimits();
    }
    return keyframe;
  }

  // All tiles are fused, and some rows are not what was written.
  void Fill() {
    Open();
    for (const std::uint32_t sequence : {1U, 2U, 3U, 4U}) {
      ASSERT_TRUE(Put(KeyframeOf(kDay, sequence, sequence == 1 ? kA : kB)));
    }
    ASSERT_TRUE(Put(KeyframeOf(kNight, 1, kC)));
    ASSERT_TRUE(Put(KeyframeOf(kOld, 1, kA)));
    for (ClaimResult claimed = Claim(); !claimed.claims.empty(); claimed = Claim()) {
      for (const TileClaim& claim : claimed.claims) {
        ASSERT_TRUE(Finish(claim, Content(7)));
      }
    }
    tiles_ = store_->ReadCounts()->tiles;
    Tamper(
        "UPDATE keyframes SET blob = zeroblob(blob_bytes) WHERE id IN (2, 3);"
        "UPDATE poses SET x_um = x_um + 4096 WHERE keyframe_id = 4;"
        "UPDATE sessions SET checksum = ~checksum WHERE session = 'old'");
    fs::rename(options_.directory, filled());
  }
  void Prepare() override {
    if (!fs::exists(filled())) {
      Fill();
    }
    fs::copy(filled(), options_.directory, fs::copy_options::recursive);
    done_.clear();
    jumped_.clear();
    revision_ = 0;
  }

  void Note(Step step, bool is_done) {
    if (is_done) {
      done_.insert(step);
    }
  }
  void Acknowledged(std::uint64_t revision) {
    EXPECT_GE(revision, revision_);
    revision_ = revision;
  }
  void TryRepairs() {
    TryTables(Step::kRows, TableRepair::kRows);
    Note(Step::kNote, Await<std::uint32_t>([&](auto done) {
                        store_->NoteDamage({kSentAgain, kGivenUp}, std::move(done));
                      }).has_value());
    TryPut(Step::kSendAgain, KeyframeOf(kDay, 2, kB));
    TryRepair(Step::kRestore, {kMoved, "tester", std::nullopt, false});
    TryRepair(Step::kGiveUp, {kGivenUp, "tester", std::nullopt, true});
    TryTables(Step::kSums, TableRepair::kSums);
  }
  void TryTables(Step step, TableRepair repair) {
    Note(step, Await<std::uint32_t>([&](auto done) {
                 store_->RepairTables(repair, "tester", std::move(done));
               }).has_value());
  }
  void TryRepair(Step step, const KeyframeRepair& repair) {
    const auto repaired =
        Await<RepairOutcome>([&](auto done) { store_->RepairKeyframe(repair, std::move(done)); });
    Note(step, repaired && *repaired != RepairOutcome::kDamaged);
  }
  void TryPut(Step step, const NewKeyframe& keyframe) {
    const auto put = Put(keyframe);
    Note(step, put.has_value());
    if (put) {
      Acknowledged(put->revision);
    }
  }
  void TryCompact() {
    const auto ids = store_->ListKeyframeIds(0, 100);
    if (!ids) {
      return;
    }
    if (std::find(ids->begin(), ids->end(), kDropped) == ids->end()) {
      Note(Step::kCompact, true);
      return;
    }
    const auto compacted = Await<CompactionResult>([&](auto done) {
      store_->Compact({store_->revision(), 5'000, {kDropped}, "tester"}, std::move(done));
    });
    Note(Step::kCompact, compacted.has_value());
    if (compacted) {
      Acknowledged(compacted->revision);
    }
  }
  void TryJump() {
    for (const std::uint32_t sequence : {1U, 2U}) {
      const auto put = Put(KeyframeOf(kWild, sequence, kC));
      if (put) {
        jumped_.insert(sequence);
        Acknowledged(put->revision);
      }
    }
    Note(Step::kJump, jumped_.size() == 2);
  }
  void TryChange(Step step, const SessionKey& key, SessionAction action) {
    const auto changed = Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({key, action, "tester", ""}, std::move(done));
    });
    Note(step, changed.has_value());
    if (changed) {
      Acknowledged(changed->revision);
    }
  }

  void Live() override {
    if (!TryOpen()) {
      return;
    }
    TryRepairs();
    TryCompact();
    TryJump();
    TryChange(Step::kRelease, kWild, SessionAction::kRelease);
    if (!TryOpen()) {
      return;
    }
    TryChange(Step::kPurge, kNight, SessionAction::kPurge);
    Note(Step::kRules, TryRules().has_value());
    store_->Flush();
    store_.reset();
  }
  Result<std::uint64_t> TryRules() {
    return Await<std::uint64_t>(
        [&](auto done) { store_->AdoptFusionRules(kNewRules, std::move(done)); });
  }

  void ExpectAllThere() override {
    ASSERT_TRUE(TryOpen());
    EXPECT_GE(store_->revision(), revision_);
    ExpectRepairs();
    ExpectCompaction();
    ExpectJump();
    ExpectPurge();
    ExpectRules();
    // And it goes on: what was refused is done now.
    Live();
    ASSERT_TRUE(TryOpen());
    ExpectAllDone();
  }

  bool IsDone(Step step) const { return done_.contains(step); }
  bool IsThere(std::int64_t id) {
    const auto ids = store_->ListKeyframeIds(0, 100).value();
    return std::find(ids.begin(), ids.end(), id) != ids.end();
  }
  bool IsListed(std::int64_t id) {
    const auto damaged = store_->ListDamagedKeyframes().value();
    return std::any_of(damaged.begin(), damaged.end(),
                       [id](const DamagedKeyframe& listed) { return listed.id == id; });
  }
  std::optional<SessionState> StateOf(const SessionKey& key) {
    const auto found = store_->FindSession(key).value();
    return found ? std::optional(found->state) : std::nullopt;
  }
  std::size_t InTheMap(const TileId& tile) {
    return store_->GatherTile(tile, 0).value().keyframes.size();
  }
  static void ExpectGood(const Status& status) { EXPECT_TRUE(status.ok()) << status.message(); }
  void ExpectMarked(Step step, const TileId& tile) {
    if (IsDone(step)) {
      EXPECT_TRUE(marked_.contains(tile)) << tile << " would never be fused";
    }
  }

  void ExpectRepairs() {
    if (IsDone(Step::kRows)) {
      EXPECT_EQ(StateOf(kOld), SessionState::kLive);
    }
    if (IsDone(Step::kSums) || (store_->FindSession(kOld) && IsThere(kGivenUp))) {
      ExpectGood(store_->CheckCounters());
    }
    const bool is_healed = store_->ReadKeyframeBlob(kSentAgain).has_value();
    EXPECT_TRUE(is_healed || !IsDone(Step::kSendAgain));
    EXPECT_FALSE(is_healed && IsListed(kSentAgain));
    EXPECT_TRUE(store_->ReadKeyframe(kMoved).has_value() || !IsDone(Step::kRestore));
    const bool is_there = IsThere(kGivenUp);
    EXPECT_FALSE(is_there && IsDone(Step::kGiveUp));
    EXPECT_FALSE(!is_there && IsListed(kGivenUp));
    EXPECT_EQ(store_->ListKeyframesOfTile(kB)->size(), is_there ? 3U : 2U);
    if (IsDone(Step::kNote)) {
      EXPECT_TRUE(is_healed || IsListed(kSentAgain));
      EXPECT_TRUE(!is_there || IsListed(kGivenUp));
    }
  }
  void ExpectCompaction() {
    const bool is_there = IsThere(kDropped);
    EXPECT_FALSE(is_there && IsDone(Step::kCompact));
    EXPECT_EQ(store_->ReadCounts()->compacted, is_there ? 0U : 1U);
    EXPECT_EQ(store_->ReadKeyframe(kDropped).has_value(), is_there);
    EXPECT_EQ(store_->CheckRevision(1).ok(), is_there && IsThere(kGivenUp) && IsThere(kPurged));
    ExpectGood(store_->CheckCompactions());
    ExpectGood(store_->CheckSession(kDay));
  }
  // The verdict follows from what is there, and from what was said about it.
  void ExpectJump() {
    std::uint64_t there = 0;
    const auto state = StateOf(kWild);
    if (state) {
      there = store_->FindSession(kWild).value()->keyframes;
      ExpectGood(store_->CheckSession(kWild));
    }
    EXPECT_GE(there, jumped_.size());
    for (const std::uint32_t sequence : jumped_) {
      const std::vector<KeyframeKey> keys{{kWild, sequence}};
      const auto found = store_->FindKeyframes(keys);
      ASSERT_TRUE(found.has_value()) << found.error().message();
      EXPECT_EQ(store_->ReadKeyframeBlob(found->at(0)->id).value(),
                KeyframeOf(kWild, sequence, kC).blob);
    }
    if (there == 2) {
      EXPECT_TRUE(state == SessionState::kReleased ||
                  (state == SessionState::kQuarantined && !IsDone(Step::kRelease)));
    }
    EXPECT_EQ(store_->ReadCounts()->quarantined, state == SessionState::kQuarantined ? 1U : 0U);
    const std::size_t of_night = StateOf(kNight) == SessionState::kLive ? 1 : 0;
    EXPECT_EQ(InTheMap(kC), of_night + (state == SessionState::kQuarantined ? 0 : there));
  }
  void ExpectPurge() {
    const bool is_purged = StateOf(kNight) == SessionState::kPurged;
    EXPECT_TRUE(is_purged || !IsDone(Step::kPurge));
    EXPECT_NE(IsThere(kPurged), is_purged);
    EXPECT_EQ(store_->ReadKeyframeBlob(kPurged).has_value(), !is_purged);
    ExpectGood(store_->CheckSession(kNight));
  }
  // Marks, too. Whoever asks for the rules sets those that are missing.
  void ExpectRules() {
    for (const TileClaim& claim : Claim().claims) {
      marked_.insert(claim.id);
    }
    ExpectMarked(Step::kSendAgain, kB);
    ExpectMarked(Step::kRestore, kB);
    ExpectMarked(Step::kGiveUp, kB);
    ExpectMarked(Step::kJump, kC);
    ExpectMarked(Step::kRelease, kC);
    ExpectMarked(Step::kPurge, kC);
    const std::uint64_t dirty = Dirty().dirty_tiles;
    const auto adopted = TryRules();
    ASSERT_TRUE(adopted.has_value()) << adopted.error().message();
    EXPECT_FALSE(*adopted > 0 && IsDone(Step::kRules));
    if (*adopted == 0) {
      EXPECT_GE(dirty, tiles_) << "rules were adopted, and not every tile is marked";
    }
    marked_.clear();
  }
  void ExpectAllDone() {
    EXPECT_EQ(done_.size(), static_cast<std::size_t>(Step::kRules) + 1) << "refused again";
    ExpectGood(store_->CheckCounters());
    ExpectGood(store_->CheckCompactions());
    for (const SessionKey& key : {kDay, kNight, kOld, kWild}) {
      ExpectGood(store_->CheckSession(key));
    }
    EXPECT_TRUE(store_->ListDamagedKeyframes()->empty());
    EXPECT_EQ(StateOf(kWild), SessionState::kReleased);
    const auto ids = store_->ListKeyframeIds(0, 100).value();
    EXPECT_EQ(ids.size(), 5U);
    for (const std::int64_t id : ids) {
      const auto read = store_->ReadKeyframe(id);
      EXPECT_TRUE(read.has_value()) << read.error().message();
      EXPECT_TRUE(store_->ReadKeyframeBlob(id).has_value()) << id;
    }
    EXPECT_EQ(InTheMap(kA) + InTheMap(kB) + InTheMap(kC), 5U);
    EXPECT_EQ(Dirty().dirty_tiles, tiles_);
  }

 private:
  fs::path filled() const { return directory_ / "filled"; }

  std::set<Step> done_;
  std::set<std::uint32_t> jumped_;  // sequence numbers that were acknowledged
  std::set<TileId> marked_;
  std::uint64_t revision_ = 0;
  std::uint64_t tiles_ = 0;
};

TEST_F(UpkeepFaultTest, ThePowerIsCutAtAnyCallAndNothingUnsyncedIsThere) {
  EXPECT_GT(CutPowerAtEach(Loss::kAll), 300U);
}

TEST_F(UpkeepFaultTest, ThePowerIsCutAtAnyCallAndSomeOfTheUnsyncedIsThere) {
  EXPECT_GT(CutPowerAtEach(Loss::kSome), 300U);
}

TEST_F(UpkeepFaultTest, ThePowerIsCutAtAnyCallAndWritesAreTorn) {
  EXPECT_GT(CutPowerAtEach(Loss::kSectors), 300U);
}

TEST_F(UpkeepFaultTest, AnyCallFailsOnce) {
  EXPECT_GT(FailEach(Calls::kAll, Until::kOnce), 300U);
}

TEST_F(UpkeepFaultTest, AnyCallAndAllBehindItFail) {
  EXPECT_GT(FailEach(Calls::kAll, Until::kHealed), 300U);
}

TEST_F(UpkeepFaultTest, TheDiskIsFullFromAnyWriteOn) {
  EXPECT_GT(FailEach(Calls::kWrite, Until::kHealed, true), 200U);
}

}  // namespace
}  // namespace atlas
