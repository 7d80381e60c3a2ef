// A new atlas whose disk fails, is full or loses its power at any call until it was opened for the
// first time: the next opening gives a whole one, and nobody has to look after it.
#include <filesystem>
#include <string>

#include "server/store/sqlite/revision_note.h"
#include "tests/server/store/io_fault_fixture.h"

namespace atlas {
namespace {

class CreationFaultTest : public IoFaultFixture {
 protected:
  void Prepare() override {
    is_opened_ = false;
    options_.new_atlas_id = {kFirst};
  }
  void Live() override {
    auto store = OpenSqliteStore(options_);
    is_opened_ = store.has_value();
    if (is_opened_) {
      store_ = *std::move(store);
      return;
    }
    EXPECT_NE(store.error().code(), StatusCode::kInternal) << store.error().message();
    EXPECT_NE(store.error().code(), StatusCode::kInvalidData) << store.error().message();
  }
  void ExpectAllThere() override {
    options_.new_atlas_id = {kSecond};
    Open();
    ASSERT_TRUE(store_ != nullptr);
    const auto id = store_->identity().atlas_id;
    EXPECT_TRUE(id[0] == kFirst || (id[0] == kSecond && !is_opened_)) << "another atlas";
    ExpectNew();
    const auto put = Put(Large(1, {TileId{0, 0, 0}}));
    ASSERT_TRUE(put.has_value()) << put.error().message();
    Open();
    EXPECT_EQ(store_->identity().atlas_id, id);
    EXPECT_EQ(store_->ReadCounts()->keyframes, 1U);
    EXPECT_EQ(Claim().claims.size(), 1U);
    ++(id[0] == kFirst ? kept_ : made_again_);
  }

  void ExpectNew() {
    EXPECT_EQ(store_->identity().profile, *options_.new_profile);
    const StoreCounts counts = store_->ReadCounts().value();
    EXPECT_EQ(counts.revision + counts.keyframes + counts.sessions + counts.tiles, 0U);
    EXPECT_EQ(counts.dirty_tiles, 0U);
    EXPECT_TRUE(store_->ListEvents(0, 10)->empty()) << "something had to be repaired";
    const Status counted = store_->CheckCounters();
    EXPECT_TRUE(counted.ok()) << counted.message();
    for (const auto& entry : std::filesystem::directory_iterator(options_.directory)) {
      const std::string name = entry.path().filename().string();
      EXPECT_FALSE(name.starts_with("atlas.db.")) << name << " is left";
    }
  }
  void ExpectBoth() const {
    const int stride = static_cast<int>(testing::Stride());
    EXPECT_GT(made_again_ * stride, 10);
    EXPECT_GT(kept_ * stride, 3);
  }

 private:
  static constexpr std::uint8_t kFirst = 1;
  static constexpr std::uint8_t kSecond = 2;

  bool is_opened_ = false;  // and told so
  int kept_ = 0;
  int made_again_ = 0;
};

// Whoever deletes atlas.db after a kill, to begin anew, leaves it.
TEST_F(CreationFaultTest, NoAtlasIsMadeBesideTheLogOfAnother) {
  Open();
  ASSERT_TRUE(Put(Large(1, {TileId{0, 0, 0}})).has_value());
  const std::filesystem::path log = Database().string() + "-wal";
  const std::filesystem::path copy = directory_ / "log";
  std::filesystem::copy_file(log, copy);
  store_.reset();
  std::filesystem::remove(Database());
  std::filesystem::copy_file(copy, log);
  const auto refused = OpenSqliteStore(options_);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), StatusCode::kConflict);
  EXPECT_NE(refused.error().message().find(log.string()), std::string::npos);
  EXPECT_EQ(std::filesystem::file_size(log), std::filesystem::file_size(copy));
  std::filesystem::remove(log);
  EXPECT_EQ(OpenCode(), StatusCode::kConflict) << "the note tells of it, too";
  std::filesystem::remove(NoteOf(Database()));
  Open();
  ExpectNew();
}

TEST_F(CreationFaultTest, ThePowerIsCutAndNothingUnsyncedIsThere) {
  CutPowerAtEach(Loss::kAll);
  ExpectBoth();
}

TEST_F(CreationFaultTest, ThePowerIsCutAndSomeOfTheUnsyncedIsThere) {
  CutPowerAtEach(Loss::kSome);
  ExpectBoth();
}

TEST_F(CreationFaultTest, ThePowerIsCutAndWritesAreTorn) {
  CutPowerAtEach(Loss::kSectors);
  ExpectBoth();
}

TEST_F(CreationFaultTest, AnyCallFailsOnce) {
  FailEach(Calls::kAll, Until::kOnce);
  ExpectBoth();
}

TEST_F(CreationFaultTest, AnyCallAndAllBehindItFail) {
  FailEach(Calls::kAll, Until::kHealed);
  ExpectBoth();
}

TEST_F(CreationFaultTest, TheDiskIsFullFromAnyWriteOn) {
  EXPECT_GT(FailEach(Calls::kWrite, Until::kHealed, true), 10U);
}

}  // namespace
}  // namespace atlas
