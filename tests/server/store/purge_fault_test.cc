// A purge whose disk fails at any of its calls, is full or loses its power, or whose process is
// killed: all of the session is there afterwards, or nothing.
#include "tests/core/support/test_scale.h"
#include "tests/server/store/faulty_vfs.h"
#include "tests/server/store/purge_fixture.h"

namespace atlas {
namespace {

using Calls = FaultyVfs::Calls;
using Until = FaultyVfs::Until;
using Loss = VolatileFiles::Loss;

class PurgeFaultTest : public PurgeTest {
 protected:
  ~PurgeFaultTest() override { store_.reset(); }  // before the layer that it was opened with goes

  // True: it was said to be done.
  bool TryPurge() {
    auto store = OpenSqliteStore(options_);
    if (!store) {
      return false;
    }
    store_ = std::move(*store);
    const bool is_done = Change(SessionAction::kPurge).has_value();
    store_.reset();
    return is_done;
  }
  void ExpectAllOrNothing(bool is_done) {
    Open();
    const auto day = store_->FindSession(Day());
    ASSERT_TRUE(day.has_value() && *day);
    const bool is_purged = (*day)->state == SessionState::kPurged;
    EXPECT_TRUE(is_purged || !is_done);
    EXPECT_EQ(store_->ReadCounts()->keyframes, is_purged ? kCount : 2 * kCount);
    ExpectSound();
    if (!is_purged) {
      EXPECT_TRUE(Put(Large(1))->is_duplicate);
      EXPECT_TRUE(Change(SessionAction::kPurge).has_value());
    }
    EXPECT_TRUE(IsSoonGone(Secret()));
    (is_purged ? purged_ : kept_) += 1;
    store_.reset();
  }
  // Each call in its turn, until none is left to fail; `then` whatever becomes of the disk.
  template <typename Then>
  void FailEach(Calls calls, Until until, bool is_full, const Then& then) {
    for (std::uint64_t number = 1; !HasFailure(); number += testing::Stride()) {
      std::filesystem::remove_all(options_.directory);
      Fill();
      store_.reset();
      vfs_.BeginAnew();
      vfs_.FailAt(number, calls, until, is_full);
      const bool is_done = TryPurge();
      const bool has_failed = vfs_.Heal();
      then(static_cast<std::uint32_t>(number));
      SCOPED_TRACE("call " + std::to_string(number) + ", " + vfs_.first());
      ExpectAllOrNothing(is_done);
      if (!has_failed) {
        break;
      }
    }
    EXPECT_GT(kept_, 3);
    EXPECT_GT(purged_, 0);
    RecordProperty("points", kept_ + purged_);
  }
  void FailEach(Calls calls, Until until, bool is_full = false) {
    FailEach(calls, until, is_full, [](std::uint32_t) {});
  }
  void CutPowerAtEach(Loss loss) {
    FailEach(Calls::kAll, Until::kHealed, false,
             [&](std::uint32_t number) { vfs_.LosePower(loss, number); });
  }

 private:
  FaultyVfs vfs_;
  int purged_ = 0;
  int kept_ = 0;
};

TEST_F(PurgeFaultTest, ThePowerIsCutAndNothingUnsyncedIsThere) {
  CutPowerAtEach(Loss::kAll);
}

TEST_F(PurgeFaultTest, ThePowerIsCutAndSomeOfTheUnsyncedIsThere) {
  CutPowerAtEach(Loss::kSome);
}

TEST_F(PurgeFaultTest, ThePowerIsCutAndWritesAreTorn) {
  CutPowerAtEach(Loss::kSectors);
}

TEST_F(PurgeFaultTest, ItIsKilledAtAnyCall) {
  FailEach(Calls::kAll, Until::kHealed);
}

TEST_F(PurgeFaultTest, AnyCallFailsOnce) {
  FailEach(Calls::kAll, Until::kOnce);
}

TEST_F(PurgeFaultTest, TheDiskIsFullFromAnyWriteOn) {
  FailEach(Calls::kWrite, Until::kHealed, true);
}

}  // namespace
}  // namespace atlas
