// A backup and a restore whose disk fails at any one of its calls, once or from then on, or is
// full, or loses its power: there is a whole one, or none, and the atlas that was there.
#include "tests/core/support/test_scale.h"
#include "tests/server/store/backup_fixture.h"
#include "tests/server/store/faulty_vfs.h"

namespace atlas {
namespace {

using Calls = FaultyVfs::Calls;
using Until = FaultyVfs::Until;
using Loss = VolatileFiles::Loss;

class BackupFaultTest : public BackupTest {
 protected:
  BackupFaultTest() {
    Fill(5, 3'000);
    store_.reset();
    rows_ = RowsOf(Database());
  }
  ~BackupFaultTest() override { store_.reset(); }  // before the layer that it was opened with goes

  // `work` with each call failing in its turn; `judge` is told whether it said that it was done.
  // How many calls there were.
  template <typename Work, typename Judge>
  std::uint64_t FailEach(
      Calls calls, Until until, bool is_full, const Work& work, const Judge& judge) {
    for (std::uint64_t number = 1;; number += testing::Stride()) {
      vfs_.BeginAnew();
      vfs_.FailAt(number, calls, until, is_full);
      const bool is_done = work();
      const bool has_failed = vfs_.Heal();
      SCOPED_TRACE("call " + std::to_string(number) + ", " + vfs_.first());
      judge(number, is_done);
      if (!has_failed || HasFailure()) {
        points_ += number - 1;
        RecordProperty("points", static_cast<int>(points_));
        return number - 1;
      }
    }
  }
  // Of all ways in which calls fail.
  template <typename Work, typename Judge>
  void FailInAllWays(std::uint64_t least, const Work& work, const Judge& judge) {
    EXPECT_GT(FailEach(Calls::kAll, Until::kOnce, false, work, judge), least);
    EXPECT_GT(FailEach(Calls::kAll, Until::kHealed, false, work, judge), least);
    EXPECT_GT(FailEach(Calls::kSync, Until::kOnce, false, work, judge), 0U);
    EXPECT_GT(FailEach(Calls::kWrite, Until::kHealed, true, work, judge), 3U);
  }

  // What is there is whole.
  void ExpectWhole() {
    RestoreOrder order{backup(), directory_ / "judged" / "atlas.db", false, Work()};
    const auto whole = RestoreAtlas(order);
    EXPECT_TRUE(whole.has_value()) << whole.error().message();
    EXPECT_EQ(RowsOf(order.target), rows_);
    std::filesystem::remove_all(order.target.parent_path());
  }
  // One that could not be said to be there may be, whole: its folder was not synced.
  void JudgeBackup(bool is_done) {
    const bool is_there = std::filesystem::exists(backup());
    EXPECT_TRUE(is_there || !is_done);
    if (is_there) {
      ExpectWhole();
    }
    std::filesystem::remove(backup());
    EXPECT_TRUE(NamesIn(folder()).empty());
  }
  // What was removed may be there again, for the daemon's next start to remove.
  void ForgetPartial() { std::filesystem::remove(backup().string() + ".partial"); }
  // A backup of five keyframes, and an atlas of four that it takes the place of.
  void MakeBoth() {
    Open();
    ASSERT_TRUE(WriteBackup().has_value());
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Fill(4);
    store_.reset();
    std::filesystem::rename(Database(), replaced());
    MakeReplaced();
  }
  void MakeReplaced() {
    std::filesystem::remove_all(restored().parent_path());
    std::filesystem::create_directories(restored().parent_path());
    std::filesystem::copy_file(replaced(), restored());
  }
  std::filesystem::path replaced() const { return directory_ / "replaced.db"; }
  void JudgeRestore(bool is_done) {
    SqliteStoreOptions options = options_;
    options.directory = restored().parent_path();
    auto opened = OpenSqliteStore(options);
    if (!opened && opened.error().code() == StatusCode::kConflict) {
      EXPECT_FALSE(is_done);
      ASSERT_TRUE(Restore(true).has_value());  // between two names, it is to be run again
      opened = OpenSqliteStore(options);
    }
    ASSERT_TRUE(opened.has_value()) << opened.error().message();
    const bool is_new = (*opened)->identity().epoch != 1;
    EXPECT_TRUE(is_new || !is_done);
    EXPECT_EQ((*opened)->ReadCounts()->keyframes, is_new ? 5U : 4U);
    const Status counted = (*opened)->CheckCounters();
    EXPECT_TRUE(counted.ok()) << counted.message();
    EXPECT_FALSE(std::filesystem::exists(restored().string() + ".partial"));
  }

  FaultyVfs vfs_;
  std::uint64_t points_ = 0;
  std::map<std::string, std::string> rows_;  // of the atlas that is backed up
};

TEST_F(BackupFaultTest, ABackupIsWholeOrNotThere) {
  Open();
  FailInAllWays(
      20, [this] { return WriteBackup().has_value(); },
      [this](std::uint64_t, bool is_done) { JudgeBackup(is_done); });
  EXPECT_TRUE(Put(Keyframe(6)).has_value()) << "the atlas goes on";
}

TEST_F(BackupFaultTest, ABackupThatIsThereSurvivesAPowerCut) {
  for (const Loss loss : {Loss::kAll, Loss::kSome, Loss::kSectors}) {
    const auto write = [this] {
      return WriteBackup().has_value();
    };
    const auto judge = [this, loss](std::uint64_t number, bool is_done) {
      store_.reset();
      vfs_.LosePower(loss, static_cast<std::uint32_t>(number));
      ForgetPartial();
      JudgeBackup(is_done);
      Open();
    };
    Open();
    EXPECT_GT(FailEach(Calls::kAll, Until::kHealed, false, write, judge), 20U);
  }
}

TEST_F(BackupFaultTest, ARestoreLeavesOneAtlasOrTheOther) {
  const auto judge = [this](std::uint64_t, bool is_done) {
    JudgeRestore(is_done);
    MakeReplaced();
  };
  MakeBoth();
  FailInAllWays(
      20, [this] { return Restore(true).has_value(); }, judge);
}

TEST_F(BackupFaultTest, ARestoredAtlasSurvivesAPowerCut) {
  MakeBoth();
  for (const Loss loss : {Loss::kAll, Loss::kSome, Loss::kSectors}) {
    const auto judge = [this, loss](std::uint64_t number, bool is_done) {
      vfs_.LosePower(loss, static_cast<std::uint32_t>(number));
      JudgeRestore(is_done);
      MakeReplaced();
    };
    const auto restore = [this] {
      return Restore(true).has_value();
    };
    EXPECT_GT(FailEach(Calls::kAll, Until::kHealed, false, restore, judge), 20U);
  }
}

}  // namespace
}  // namespace atlas
