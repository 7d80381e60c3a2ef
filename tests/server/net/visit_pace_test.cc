#include "server/net/connection/visit_pace.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Clock = VisitPace::Clock;

void Visit(VisitPace& pace, Clock::time_point begin) {
  const Places::Place place = pace.Begin(nullptr, begin);
}

TEST(VisitPaceTest, ShortVisitsBeyondTheRateAreWaitedFor) {
  VisitPace pace({10, seconds(1), 20, milliseconds(150)});
  const Clock::time_point now = Clock::now();
  for (int i = 0; i < 10; ++i) {
    Visit(pace, now);
  }
  EXPECT_EQ(pace.Pause(now), seconds(0));
  Visit(pace, now);
  EXPECT_EQ(pace.Pause(now), milliseconds(100));
  pace.NoteRefusal();
  EXPECT_EQ(pace.Pause(now), milliseconds(150)) << "and no longer";
  EXPECT_EQ(pace.Pause(now + milliseconds(200)), seconds(0));
}

TEST(VisitPaceTest, WhoStaysIsNotCounted) {
  VisitPace pace({1, seconds(1), 20, seconds(9)});
  const Clock::time_point now = Clock::now();
  const Places::Place place = pace.Begin(nullptr, now);
  for (int i = 0; i < 10; ++i) {
    Visit(pace, now - seconds(2));
  }
  EXPECT_EQ(pace.Pause(now), seconds(0));
}

TEST(VisitPaceTest, WhoNeverBeganCountsForLittle) {
  VisitPace pace({10, seconds(1), 20, seconds(9)});
  const Clock::time_point now = Clock::now();
  for (int i = 0; i < 200; ++i) {
    pace.NoteGone();
  }
  EXPECT_EQ(pace.Pause(now), seconds(0));
  for (int i = 0; i < 20; ++i) {
    pace.NoteGone();
  }
  EXPECT_EQ(pace.Pause(now), milliseconds(100));
}

TEST(VisitPaceTest, WithoutALimitNobodyWaits) {
  VisitPace pace({0, seconds(1), 20, seconds(9)});
  for (int i = 0; i < 10; ++i) {
    Visit(pace, Clock::now());
  }
  EXPECT_EQ(pace.Pause(Clock::now()), seconds(0));
}

}  // namespace
}  // namespace atlas
