// A tile that goes on failing: how often all that it is made of is read, and people are told.
#include <atomic>
#include <functional>
#include <future>

#include "tests/server/service/blob_reads.h"
#include "tests/server/service/damage_fixture.h"
#include "tests/server/store/lost_rows.h"

namespace atlas {
namespace {

class DamageLooksTest : public DamageTest {
 protected:
  struct Failures {
    int reads_before = 0;  // of blobs, until the first of them
    int reads_behind = 0;  // likewise, from there to the last
    int errors = 0;        // lines for people
  };

  // One of those of the keyframe that is spoiled, if one is.
  TileId TileOfTheDamaged() { return store_->ReadKeyframe(4).value().footprint.front(); }
  // Without a service, and with whoever watches the connections that are opened from now on.
  void MarkAlone(const TileId& tile) {
    OpenStore();
    ASSERT_TRUE(
        Await<std::uint32_t>([&](auto done) { store_->MarkDirty({tile}, std::move(done)); }));
  }
  void Beside(const std::string& sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((directory_ / "data" / "atlas.db").c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(db);
    sqlite3_close(db);
  }
  // Until the one tile that is dirty has failed so often. `on_first` is called behind the first.
  Failures FailTimes(int tries, const std::function<void()>& on_first = nullptr) {
    Failures failures;
    std::promise<void> is_over;
    ServiceOptions options;
    options.fusion.building.surveys = {0, 0};
    options.fusion.min_backoff_ms = 0;
    int tried = 0;
    const auto note = [&](LogLevel level, const std::string& message) {
      if (message.find("keeps its content and stays dirty") == std::string::npos ||
          tried == tries) {
        return;
      }
      failures.errors += level == LogLevel::kError ? 1 : 0;
      if (tried == 0) {
        failures.reads_before = reads_;
        if (on_first) {
          on_first();
        }
      }
      if (++tried == tries) {
        failures.reads_behind = reads_ - failures.reads_before;
        is_over.set_value();
      }
    };
    service_ = std::make_unique<AtlasService>(
        *store_, [this] { return ++now_ms_; }, note, options);
    EXPECT_EQ(is_over.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
    service_.reset();
    return failures;
  }

  std::atomic<int> reads_ = 0;
};

// What a tile is made of is read by who builds it, up to what is damaged; all of it is looked at
// once.
TEST_F(DamageLooksTest, ATileThatCannotBeBuiltIsLookedAtOnce) {
  Fill();
  Tamper(kSpoilBlob);
  const TileId tile = TileOfTheDamaged();
  Close();
  const BlobReads watch([&] { ++reads_; });
  MarkAlone(tile);
  constexpr int kTries = 12;
  const Failures failures = FailTimes(kTries);
  EXPECT_GT(failures.reads_before, 2);
  EXPECT_LT(failures.reads_behind, 2 * (kTries - 1)) << "the damaged one at each";
  EXPECT_EQ(failures.errors, 1);
}

// Its keyframes are whole, and kept by who builds it; the index of the marks has another one of it.
TEST_F(DamageLooksTest, SoIsOneThatCannotBeWritten) {
  Fill();
  const TileId tile = TileOfTheDamaged();
  Close();
  const BlobReads watch([&] { ++reads_; });
  MarkAlone(tile);
  const std::string of_tile = " WHERE key = " + std::to_string(tile.Key());
  Beside("CREATE TABLE marked AS SELECT since FROM dirty_tiles" + of_tile +
         "; UPDATE dirty_tiles SET since = 5" + of_tile);
  Beside(testing::WithoutIndex(
      "dirty_since", "UPDATE dirty_tiles SET since = (SELECT since FROM marked)" + of_tile));
  const Failures failures = FailTimes(12);
  EXPECT_GT(failures.reads_before, 2);
  EXPECT_EQ(failures.reads_behind, 0);
  EXPECT_EQ(failures.errors, 1);
}

// About an hour later; what became damaged since is noted then.
TEST_F(DamageLooksTest, OneThatGoesOnFailingIsLookedAtAgain) {
  Fill();
  Tamper(kSpoilBlob);
  const TileId tile = TileOfTheDamaged();
  const auto keyframes = store_->ListKeyframesOfTile(tile).value();
  ASSERT_GT(keyframes.back(), 4) << "one that is read behind the damaged one";
  Close();
  MarkAlone(tile);
  FailTimes(70, [&] {
    Beside("UPDATE keyframes SET blob = zeroblob(blob_bytes) WHERE id = " +
           std::to_string(keyframes.back()));
  });
  EXPECT_EQ(Listed(), 2U);
}

}  // namespace
}  // namespace atlas
