// An upgrade that is ended at any call to the disk: the atlas is whole, of its earlier version or
// of today's.
#include <optional>

#include "tests/core/support/test_scale.h"
#include "tests/server/store/faulty_vfs.h"
#include "tests/server/store/migration_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;
using Calls = FaultyVfs::Calls;
using Loss = VolatileFiles::Loss;
using Until = FaultyVfs::Until;

class MigrationFaultTest : public EarlierStoreTest {
 protected:
  // Less than the upgrade changes: pages are in the log before it is whole.
  MigrationFaultTest() { options_.writer_cache_kib = 16; }
  ~MigrationFaultTest() override { store_.reset(); }  // before the layer that it was opened with

  struct Fault {
    Calls calls = Calls::kAll;
    Until until = Until::kHealed;
    bool is_full = false;
    std::optional<Loss> loss = std::nullopt;  // of power, then
  };
  // At each call in its turn, until none is left. How many there were.
  std::uint64_t FailEach(const Fault& fault) {
    fs::remove_all(options_.directory);
    fs::remove_all(directory_ / "original");
    Make();
    fs::rename(options_.directory, directory_ / "original");
    const auto before = testing::DumpStore(directory_ / "original" / "atlas.db");
    for (std::uint64_t number = 1;; number += testing::Stride()) {
      PutBack("original");
      vfs_.BeginAnew();
      vfs_.FailAt(number, fault.calls, fault.until, fault.is_full);
      const StatusCode code = OpenCode();
      const bool has_failed = vfs_.Heal();
      SCOPED_TRACE("call " + std::to_string(number) + ", " + vfs_.first());
      if (fault.loss) {
        vfs_.LosePower(*fault.loss, static_cast<std::uint32_t>(number));
      }
      EXPECT_NE(code, StatusCode::kInternal);
      EXPECT_NE(code, StatusCode::kInvalidData);
      ExpectWhole(before, code == StatusCode::kOk);
      if (!has_failed || HasFailure()) {
        calls_ += number - 1;
        RecordProperty("calls", static_cast<int>(calls_));
        return number - 1;
      }
    }
  }

 private:
  void PutBack(const std::string& name) {
    store_.reset();
    fs::remove_all(options_.directory);
    fs::copy(directory_ / name, options_.directory, fs::copy_options::recursive);
  }
  void ExpectWhole(const std::vector<std::string>& before, bool is_upgraded) {
    fs::remove_all(directory_ / "copy");
    fs::copy(options_.directory, directory_ / "copy", fs::copy_options::recursive);
    const fs::path copy = directory_ / "copy" / "atlas.db";
    const std::int64_t version = testing::SchemaVersionOf(copy);
    if (version == GetParam().version) {
      EXPECT_FALSE(is_upgraded);
      EXPECT_TRUE(testing::DumpStore(copy) == before);
    } else {
      EXPECT_EQ(version, kStoreSchemaVersion);
    }
    Open();
    ASSERT_TRUE(store_ != nullptr);
    ExpectSound();
    store_.reset();
  }

  FaultyVfs vfs_;
  std::uint64_t calls_ = 0;
};

// One of each version, all that its step has to do.
INSTANTIATE_TEST_SUITE_P(Versions,
                         MigrationFaultTest,
                         ::testing::Values(testing::EarlierStore{"store_v1_first", 1},
                                           testing::EarlierStore{"store_v2", 2},
                                           testing::EarlierStore{"store_v3_first", 3},
                                           testing::EarlierStore{"store_v4", 4},
                                           testing::EarlierStore{"store_v5", 5}),
                         [](const auto& made) { return std::string(made.param.name); });

TEST_P(MigrationFaultTest, ThePowerIsCutAtAnyCall) {
  for (const Loss loss : {Loss::kAll, Loss::kSome, Loss::kSectors}) {
    EXPECT_GT(FailEach({.loss = loss}), 30U);
  }
}

TEST_P(MigrationFaultTest, AnyCallFailsOnce) {
  EXPECT_GT(FailEach({.until = Until::kOnce}), 30U);
}

TEST_P(MigrationFaultTest, AnyCallAndAllBehindItFail) {
  EXPECT_GT(FailEach({}), 30U);
}

TEST_P(MigrationFaultTest, TheDiskIsFullFromAnyWriteOn) {
  EXPECT_GT(FailEach({.calls = Calls::kWrite, .is_full = true}), 10U);
}

}  // namespace
}  // namespace atlas
