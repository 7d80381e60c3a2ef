// What vehicles are told whose uploads share a transaction with one that fails: never what is that
// one's, and nobody is told to try again for its sake.
#include <cstdint>
#include <deque>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/store/lost_rows.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

using Told = std::future<Result<PutKeyframeResult>>;

class SharedTransactionTest : public StoreTest {
 protected:
  static constexpr TileId kDamaged{0, 5, 5};

  Told Send(NewKeyframe keyframe) {
    return Begin<PutKeyframeResult>(
        [&](auto done) { store_->PutKeyframe(std::move(keyframe), std::move(done)); });
  }
  std::future<Result<SessionChangeResult>> Change(const std::string& vehicle,
                                                  SessionAction action) {
    return Begin<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({{vehicle, ""}, action, "tester", ""}, std::move(done));
    });
  }
  static NewKeyframe Of(const std::string& vehicle,
                        std::uint32_t sequence,
                        std::size_t blob_bytes,
                        const TileId& tile) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {tile});
    keyframe.key.session.vehicle = vehicle;
    keyframe.blob.assign(blob_bytes, static_cast<std::uint8_t>(sequence));
    return keyframe;
  }
  static TileId Elsewhere(std::uint32_t i) { return {0, 200 + static_cast<std::int32_t>(i), 7}; }

  // The index of marks has another entry than one tile's row.
  void DamageOneMark() {
    Open();
    ASSERT_TRUE(Put(MakeKeyframe(1, {kDamaged})));
    const std::string where = " WHERE key = " + std::to_string(kDamaged.Key());
    TamperBeside("CREATE TABLE was AS SELECT since FROM dirty_tiles" + where +
                 "; UPDATE dirty_tiles SET since = 999" + where);
    TamperBeside(testing::WithoutIndex(
        "dirty_since", "UPDATE dirty_tiles SET since = (SELECT since FROM was)" + where));
  }
};

TEST_F(SharedTransactionTest, ADamagedMarkIsOfItsTileAlone) {
  DamageOneMark();
  std::vector<Told> elsewhere;
  Told here;
  for (std::uint32_t i = 0; i < 60; ++i) {
    elsewhere.push_back(Send(Of("good", i, 1'000, Elsewhere(i))));
    if (i == 30) here = Send(Of("here", 1, 1'000, kDamaged));
  }
  for (Told& one : elsewhere) {
    const auto told = one.get();
    EXPECT_TRUE(told) << told.error().message();
  }
  const auto told = here.get();
  ASSERT_FALSE(told);
  EXPECT_EQ(told.error().code(), StatusCode::kInvalidData);
}

// Decision 0408: what damage refuses is to be sent again, so nothing behind it is taken before.
TEST_F(SharedTransactionTest, NothingIsTakenBehindWhatDamageRefused) {
  DamageOneMark();
  const auto missing = std::make_shared<MissingUploads>();
  std::vector<Told> sent;
  for (std::uint32_t i = 0; i < 10; ++i) {
    NewKeyframe keyframe = Of("good", i, 1'000, i == 5 ? kDamaged : Elsewhere(i));
    keyframe.missing = missing;
    sent.push_back(Send(std::move(keyframe)));
  }
  for (std::uint32_t i = 0; i < 10; ++i) EXPECT_EQ(sent[i].get().has_value(), i < 5) << i;
  EXPECT_EQ((*store_->FindSession({"good", "day"}))->last_sequence, 4U);
}

// A cache that is full of what others write spills pages for whatever is done in it.
TEST_F(SharedTransactionTest, AConflictIsOfWhoSentIt) {
  options_.writer_cache_kib = 1'024;
  Open();
  ASSERT_TRUE(Put(Of("wrong", 1, 100'000, {0, 900, 0})));
  std::vector<Told> good;
  std::vector<Told> wrong;
  for (std::uint32_t i = 0; i < 260; ++i) {
    good.push_back(Send(Of("good" + std::to_string(i % 8), i, 100'000, Elsewhere(i))));
    if (i % 40 != 39) continue;
    NewKeyframe other = Of("wrong", 1, 100'000, {0, 900, 0});
    other.blob.back() = 99;
    wrong.push_back(Send(std::move(other)));
  }
  for (Told& one : good) EXPECT_TRUE(one.get());
  for (Told& one : wrong) EXPECT_EQ(one.get().error().code(), StatusCode::kConflict);
  EXPECT_FALSE(store_->ReadWriteFigures().last_refusal) << "the store refuses nothing";
}

// It ends behind much that it has written, and the queue is never empty.
TEST_F(SharedTransactionTest, ALargeRefusalIsToldWhyAndRefusesNobodyElse) {
  options_.writer_cache_kib = 1'024;
  Open();
  constexpr std::int32_t kSessions = 20;
  for (std::int32_t session = 0; session < kSessions; ++session) {
    std::vector<TileId> tiles;
    for (std::int32_t i = 0; i < 1'500; ++i) tiles.push_back({0, session * 1'500 + i, 3});
    NewKeyframe keyframe = MakeKeyframe(1, std::move(tiles));
    keyframe.key.session = {"large", "s" + std::to_string(100 + session)};
    ASSERT_TRUE(Put(std::move(keyframe)));
  }
  ASSERT_TRUE(Change("large", SessionAction::kRetract).get());
  TamperBeside(
      "UPDATE session_states SET reason = 'x' WHERE session_id = "
      "(SELECT id FROM sessions WHERE session = 's119')");
  std::deque<Told> others;
  std::uint32_t sent = 0;
  const auto keep_waiting = [&] {
    for (; others.size() < 200; ++sent) {
      others.push_back(Send(Of("good", sent, 500, {0, static_cast<std::int32_t>(sent % 50), 9})));
    }
  };
  const auto take = [&] {
    EXPECT_TRUE(others.front().get());
    others.pop_front();
  };
  keep_waiting();
  auto restored = Change("large", SessionAction::kRestore);
  while (restored.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    take();
    keep_waiting();
  }
  EXPECT_EQ(restored.get().error().code(), StatusCode::kInvalidData);
  while (!others.empty()) take();
}

}  // namespace
}  // namespace atlas
