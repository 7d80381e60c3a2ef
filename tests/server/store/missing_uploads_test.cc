// What a peer sends reaches the store without gaps, whatever is refused on the way.
#include "server/store/missing_uploads.h"

#include <future>
#include <random>
#include <set>
#include <string>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

const Status kBusy(StatusCode::kUnavailable, "busy");

KeyframeKey KeyOf(std::uint32_t sequence, const char* session = "day") {
  return {{"bus", session}, sequence};
}

TEST(MissingUploadsTest, WhatIsBehindAMissingOneHasToWaitForIt) {
  MissingUploads missing;
  EXPECT_TRUE(missing.CheckTurn(KeyOf(7)).ok());
  missing.NoteEnd(KeyOf(5), kBusy);
  missing.NoteEnd(KeyOf(6), kBusy);
  for (const std::uint32_t sequence : {6u, 7u, 100u}) {
    EXPECT_EQ(missing.CheckTurn(KeyOf(sequence)).code(), StatusCode::kUnavailable) << sequence;
  }
  EXPECT_TRUE(missing.CheckTurn(KeyOf(4)).ok());
  EXPECT_TRUE(missing.CheckTurn(KeyOf(5)).ok());
  EXPECT_TRUE(missing.CheckTurn(KeyOf(7, "night")).ok());
  missing.NoteEnd(KeyOf(4), {});
  EXPECT_FALSE(missing.CheckTurn(KeyOf(6)).ok());
  missing.NoteEnd(KeyOf(5), {});
  EXPECT_TRUE(missing.CheckTurn(KeyOf(6)).ok());
  EXPECT_FALSE(missing.CheckTurn(KeyOf(7)).ok());
  missing.NoteEnd(KeyOf(6), {StatusCode::kConflict, "other content"});  // for good
  EXPECT_TRUE(missing.CheckTurn(KeyOf(7)).ok());
}

TEST(MissingUploadsTest, IsBounded) {
  MissingUploads missing;
  for (std::uint32_t i = 0; i < 10'000; ++i) {
    missing.NoteEnd(KeyOf(i), kBusy);
  }
  EXPECT_FALSE(missing.CheckTurn(KeyOf(0, "night")).ok());  // it may be one that was not noted
  EXPECT_TRUE(missing.CheckTurn(KeyOf(0)).ok());
  const KeyframeKey of_other{{"tram", "day"}, 7};
  EXPECT_TRUE(missing.CheckTurn(of_other).ok()) << "another vehicle, on this connection";
  for (std::uint32_t i = 0; i < 10'000; ++i) {
    missing.NoteEnd(KeyOf(i), {});
  }
  EXPECT_FALSE(missing.CheckTurn(KeyOf(20'000)).ok()) << "nobody knows what else was refused";
}

TEST(MissingUploadsTest, SoAreItsVehicles) {
  MissingUploads missing;
  const auto key_of = [](int vehicle) {
    return KeyframeKey{{"bus" + std::to_string(vehicle), "day"}, 0};
  };
  for (int i = 0; i < 10'000; ++i) {
    missing.NoteEnd(key_of(i), kBusy);
  }
  EXPECT_FALSE(missing.CheckTurn(key_of(20'000)).ok()) << "it may be one that was not noted";
  EXPECT_TRUE(missing.CheckTurn(key_of(0)).ok());
  MissingUploads again;
  for (int i = 0; i < 10'000; ++i) {
    again.NoteEnd(key_of(i), kBusy);
    again.NoteEnd(key_of(i), {});
  }
  EXPECT_TRUE(again.CheckTurn(key_of(20'000)).ok()) << "nothing is missing";
}

class InTurnTest : public StoreTest {
 protected:
  using Answer = std::future<Result<PutKeyframeResult>>;

  Answer Send(std::uint32_t sequence) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {{0, 1, 2}});
    keyframe.missing = missing_;
    return Begin<PutKeyframeResult>(
        [&](auto done) { store_->PutKeyframe(std::move(keyframe), std::move(done)); });
  }
  std::uint32_t last_sequence() const {
    return store_->ListSessions({}, 1'000)->at(0).last_sequence;
  }

  std::shared_ptr<MissingUploads> missing_ = std::make_shared<MissingUploads>();
};

// A vehicle that sends all it has again and again, by sequence number, into a queue that is full
// most of the time.
TEST_F(InTurnTest, NothingIsMissingBeforeTheLastOne) {
  constexpr std::uint32_t kCount = 400;
  options_.max_queued_writes = 3;
  Open();
  std::mt19937 random(5);
  std::set<std::uint32_t> stored;
  std::size_t refused = 0;
  for (int round = 0; stored.size() < kCount; ++round) {
    ASSERT_LT(round, 10'000);
    std::vector<std::pair<std::uint32_t, Answer>> answers;
    for (std::uint32_t i = 0; i < kCount && answers.size() < 1 + random() % 64; ++i) {
      if (!stored.contains(i)) {
        answers.emplace_back(i, Send(i));
      }
    }
    for (auto& [sequence, answer] : answers) {
      const auto result = answer.get();
      ASSERT_TRUE(result || result.error().code() == StatusCode::kUnavailable);
      if (result) {
        stored.insert(sequence);
      } else {
        ++refused;
      }
    }
    ASSERT_EQ(stored.size(), stored.empty() ? 0 : *stored.rbegin() + 1) << "round " << round;
  }
  EXPECT_GT(refused, 0u);
  EXPECT_EQ(last_sequence(), kCount - 1);
}

// What was refused comes again as it came: one after the other, without waiting for answers.
TEST_F(InTurnTest, AWindowThatWasRefusedComesInOneRound) {
  constexpr std::uint32_t kWindow = 64;
  Open();
  for (std::uint32_t i = 0; i < kWindow; ++i) {
    missing_->NoteEnd(KeyOf(i), kBusy);
  }
  std::vector<Answer> answers;
  for (std::uint32_t i = 0; i < kWindow; ++i) {
    answers.push_back(Send(i));
  }
  for (Answer& answer : answers) {
    const auto result = answer.get();
    EXPECT_TRUE(result) << result.error().message();
  }
  EXPECT_EQ(last_sequence(), kWindow - 1);
}

}  // namespace
}  // namespace atlas
