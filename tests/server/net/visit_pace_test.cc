#include "server/net/connection/visit_pace.h"

#include <gtest/gtest.h>

#include "server/net/connection/visit.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Clock = VisitPace::Clock;

void Note(VisitPace& pace, VisitKind kind, int times) {
  for (int i = 0; i < times; ++i) {
    pace.Note(kind);
  }
}

TEST(VisitPaceTest, VisitsBeyondTheRateAreWaitedFor) {
  VisitPace pace({10, 100, 200, milliseconds(150)});
  const Clock::time_point now = Clock::now();
  Note(pace, VisitKind::kFull, 10);
  EXPECT_EQ(pace.Pause(now), seconds(0));
  Note(pace, VisitKind::kFull, 1);
  EXPECT_EQ(pace.Pause(now), milliseconds(100));
  Note(pace, VisitKind::kFull, 1);
  EXPECT_EQ(pace.Pause(now), milliseconds(150)) << "and no longer";
  EXPECT_EQ(pace.Pause(now + milliseconds(200)), seconds(0));
}

TEST(VisitPaceTest, EachKindCountsForWhatItCosts) {
  for (const auto& [kind, per_s] : {std::pair(VisitKind::kSilent, 100), {VisitKind::kGone, 200}}) {
    VisitPace pace({10, 100, 200, seconds(9)});
    const Clock::time_point now = Clock::now();
    Note(pace, kind, per_s);
    EXPECT_EQ(pace.Pause(now), seconds(0));
    Note(pace, kind, per_s / 10);
    EXPECT_EQ(pace.Pause(now), milliseconds(100));
  }
}

TEST(VisitPaceTest, WithoutALimitNobodyWaits) {
  VisitPace pace({0, 100, 200, seconds(9)});
  Note(pace, VisitKind::kFull, 1'000);
  Note(pace, VisitKind::kSilent, 1'000);
  EXPECT_EQ(pace.Pause(Clock::now()), seconds(0));
}

// One full visit a second, ten silent ones.
class VisitTest : public ::testing::Test {
 protected:
  std::unique_ptr<Visit> Come(Clock::duration ago = {}) {
    EXPECT_TRUE(newcomers_.Enter("192.0.2.7", now_));
    return std::make_unique<Visit>(pace_, newcomers_, "192.0.2.7", nullptr, now_ - ago);
  }
  // What ended since, in full visits.
  double Ended() {
    const std::chrono::duration<double> owed = pace_.Pause(now_);
    const double cost = owed.count() - owed_;
    owed_ = owed.count();
    return cost;
  }

  const Clock::time_point now_ = Clock::now();
  VisitPace pace_{{1, 10, 20, seconds(100)}};
  Newcomers newcomers_{{8, 0, 8}};
  double owed_ = -1.0;  // what may come at once, spent below
  void SetUp() override {
    pace_.Note(VisitKind::kFull);
    EXPECT_NEAR(Ended(), 1.0, 1e-6);
  }
};

TEST_F(VisitTest, WhoWasLetInAndStaysCostsNothing) {
  Come(seconds(2))->LetIn(true);
  EXPECT_EQ(newcomers_.open(), 0u);
  EXPECT_EQ(Ended(), 0.0);
}

TEST_F(VisitTest, WhoGoesAgainAtOnceCostsWhatItDid) {
  Come();
  EXPECT_NEAR(Ended(), 0.1, 1e-6) << "it sent nothing";
  Come()->NoteSent();
  EXPECT_NEAR(Ended(), 1.0, 1e-6);
  const auto visit = Come();
  visit->NoteSent();
  visit->LetIn(true);
  EXPECT_EQ(newcomers_.open(), 0u) << "while it is there";
}

TEST_F(VisitTest, WhoNeverSaysWhoHeIsCostsHoweverLongHeStays) {
  Come(seconds(2))->NoteSent();
  EXPECT_NEAR(Ended(), 1.0, 1e-6);
  EXPECT_EQ(newcomers_.open(), 0u);
}

TEST_F(VisitTest, OnlyThoseWithoutANameCostTheirAddress) {
  Newcomers newcomers{{100, 2, 8}};
  const auto comes_often = [&](bool is_named) {
    int entered = 0;
    for (int i = 0; i < 20; ++i) {
      if (newcomers.Enter("192.0.2.9", now_)) {
        Visit visit(pace_, newcomers, "192.0.2.9", nullptr, Clock::now());
        visit.NoteSent();
        visit.LetIn(is_named);
        ++entered;
      }
    }
    return entered;
  };
  EXPECT_EQ(comes_often(true), 20);
  EXPECT_LT(comes_often(false), 10);
}

}  // namespace
}  // namespace atlas
