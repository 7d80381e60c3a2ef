// A schema that is put back on a disk that fails at any of its calls, is full or loses its power:
// the next start finds the atlas as it was, or as it is to be.
#include <functional>

#include "tests/core/support/test_scale.h"
#include "tests/server/store/faulty_vfs.h"
#include "tests/server/store/schema_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;
using Calls = FaultyVfs::Calls;
using Until = FaultyVfs::Until;
using Loss = VolatileFiles::Loss;

class SchemaFaultTest : public SchemaTest {
 protected:
  ~SchemaFaultTest() override { store_.reset(); }  // before the layer that it was opened with goes

  void Prepare() {
    Fill(4);
    store_.reset();
    texts_ = Texts();
    rows_ = RowsOf(Database());
    Spoil(Database(), "sql = replace(sql, 'INTEGER', 'INUEGER')");
    fs::copy(options_.directory, directory_ / "damaged", fs::copy_options::recursive);
  }
  // Each call in its turn, until none is left to fail; `then` whatever becomes of the disk. How
  // many there were.
  int FailEach(
      Calls calls,
      Until until,
      bool is_full,
      const std::function<void(std::uint32_t)>& then = [](std::uint32_t) {}) {
    for (std::uint32_t number = 1;; number += testing::Stride()) {
      fs::remove_all(options_.directory);
      fs::copy(directory_ / "damaged", options_.directory, fs::copy_options::recursive);
      vfs_.BeginAnew();
      vfs_.FailAt(number, calls, until, is_full);
      const StatusCode code = OpenCode();
      const bool has_failed = vfs_.Heal();
      then(number);
      SCOPED_TRACE("call " + std::to_string(number) + ", " + vfs_.first());
      EXPECT_NE(code, StatusCode::kInternal);
      EXPECT_NE(code, StatusCode::kInvalidData);
      ExpectWhole();
      if (!has_failed || HasFailure()) {
        calls_ += static_cast<int>(number) - 1;
        RecordProperty("calls", calls_);
        return static_cast<int>(number) - 1;
      }
    }
  }

  FaultyVfs vfs_;

 private:
  void ExpectWhole() {
    Open();
    ASSERT_TRUE(store_);
    EXPECT_TRUE(CheckAll().ok()) << CheckAll().message();
    store_.reset();
    EXPECT_EQ(Texts(), texts_);
    EXPECT_EQ(RowsOf(Database()), rows_);
  }

  std::vector<std::string> texts_;
  std::map<std::string, std::string> rows_;
  int calls_ = 0;
};

TEST_F(SchemaFaultTest, AnyCallFails) {
  Prepare();
  EXPECT_GT(FailEach(Calls::kAll, Until::kOnce, false), 30);
  EXPECT_GT(FailEach(Calls::kAll, Until::kHealed, false), 30);
  EXPECT_GT(FailEach(Calls::kWrite, Until::kHealed, true), 10);
}

TEST_F(SchemaFaultTest, ThePowerIsCutAtAnyCall) {
  Prepare();
  for (const Loss loss : {Loss::kAll, Loss::kSome, Loss::kSectors}) {
    FailEach(Calls::kAll, Until::kHealed, false,
             [&](std::uint32_t number) { vfs_.LosePower(loss, number); });
  }
}

// What is to be put right is written before the atlas is served, whatever it is.
TEST_F(SchemaFaultTest, AStartOnAFullDiskSaysWhatToDo) {
  for (const char* const damage :
       {"PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = replace(sql, 'INTEGER', "
        "'INUEGER')",
        "UPDATE counters SET value = 7 WHERE id = 4"}) {
    SCOPED_TRACE(damage);
    fs::remove_all(options_.directory);
    Fill(4);
    Tamper(damage);
    vfs_.FailAt(1, Calls::kWrite, Until::kHealed, true);
    const auto store = OpenSqliteStore(options_);
    EXPECT_TRUE(vfs_.Heal());
    ASSERT_FALSE(store);
    EXPECT_EQ(store.error().code(), StatusCode::kResourceExhausted);
    EXPECT_NE(store.error().message().find("make room on its disk"), std::string::npos)
        << store.error().message();
    EXPECT_EQ(OpenCode(), StatusCode::kOk);
  }
}

}  // namespace
}  // namespace atlas
