// Closures of two sessions are believed together or not at all.
#include "client/merge/plan/closure_choice.h"

#include <utility>

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"

namespace atlas {
namespace {

using testing::At;
using testing::Found;

// Ten submaps a session, along x, all sessions in one frame; those of each later one are a metre
// farther apart.
class ClosureChoiceTest : public ::testing::Test {
 protected:
  static constexpr std::size_t kSubmaps = 10;

  ClosureChoiceTest() : ways_(3) {
    for (std::size_t session = 0; session < ways_.size(); ++session) {
      for (std::size_t i = 0; i < kSubmaps; ++i) {
        const double along_m = (10.0 + static_cast<double>(session)) * static_cast<double>(i);
        ways_[session].T_session_submap.push_back(At(along_m));
        ways_[session].way_m.push_back(along_m);
      }
    }
  }

  // As it is, or with the second session moved by so much.
  FoundClosure Meeting(const SubmapRef& a,
                       const SubmapRef& b,
                       double moved_m = 0.0,
                       double explained = 0.8) const {
    const Pose T_a_b = ways_[a.session].T_session_submap[a.submap].inverse() *
                       ways_[b.session].T_session_submap[b.submap];
    return Found(a, b, At(moved_m) * T_a_b, explained);
  }
  ClosureChoice Choose(const std::vector<FoundClosure>& found) const {
    return ChooseClosures(found, ways_, options_);
  }

  std::vector<SessionWay> ways_;
  MergeOptions options_;
};

TEST_F(ClosureChoiceTest, OfNothingThereIsNoMeeting) {
  const ClosureChoice choice = Choose({});
  EXPECT_TRUE(choice.believed.empty() && choice.rejected.empty() && choice.meetings.empty());
}

TEST_F(ClosureChoiceTest, EnoughThatAgreeAreBelieved) {
  const ClosureChoice choice = Choose({Meeting({0, 1}, {1, 1}), Meeting({0, 3}, {1, 3}),
                                       Meeting({0, 6}, {1, 7}), Meeting({0, 8}, {1, 8}, 5.0)});
  EXPECT_EQ(choice.believed.size(), 3U);
  ASSERT_EQ(choice.rejected.size(), 1U);
  EXPECT_EQ(choice.rejected[0].a, (SubmapRef{0, 8}));
  ASSERT_EQ(choice.meetings.size(), 1U);
  const SessionMeeting& meeting = choice.meetings[0];
  EXPECT_EQ(meeting.a, 0U);
  EXPECT_EQ(meeting.b, 1U);
  EXPECT_EQ(meeting.found, 4U);
  EXPECT_EQ(meeting.agreeing, 3U);
  EXPECT_NEAR(meeting.margin, 3.0, 1e-9);
  EXPECT_TRUE(meeting.is_believed);
}

TEST_F(ClosureChoiceTest, TwoAreEnoughWhereTheOthersHaveThemThere) {
  const std::vector<FoundClosure> two{Meeting({0, 1}, {1, 1}), Meeting({0, 2}, {1, 2})};
  std::vector<FoundClosure> found = two;
  for (const std::size_t i : {0U, 1U, 2U}) {
    found.push_back(Meeting({0, i}, {2, i}));
    found.push_back(Meeting({1, i}, {2, i}));
  }
  const IsAsKnown all = [](const FoundClosure&) {
    return true;
  };
  const IsAsKnown one = [](const FoundClosure& closure) {
    return closure.b.submap == 1;
  };
  EXPECT_EQ(ChooseClosures(found, ways_, options_, all).believed.size(), 8U);
  EXPECT_EQ(ChooseClosures(found, ways_, options_, one).believed.size(), 6U);
  EXPECT_EQ(ChooseClosures(found, ways_, options_).believed.size(), 6U);
  found.erase(found.begin());
  EXPECT_EQ(ChooseClosures(found, ways_, options_, all).believed.size(), 6U) << "one is chance";
  EXPECT_TRUE(ChooseClosures(two, ways_, options_, all).believed.empty()) << "there are no others";
}

TEST_F(ClosureChoiceTest, OfTwoThatAreEnoughNeitherIsInDoubt) {
  std::vector<FoundClosure> found{Meeting({0, 1}, {1, 1}), Meeting({0, 2}, {1, 2})};
  for (const std::size_t i : {0U, 1U, 2U}) {
    found.push_back(Meeting({0, i}, {2, i}));
    found.push_back(Meeting({1, i}, {2, i}));
  }
  const IsAsKnown all = [](const FoundClosure&) {
    return true;
  };
  ASSERT_EQ(ChooseClosures(found, ways_, options_, all).believed.size(), 8U);
  std::vector<FoundClosure> with_rival = found;
  with_rival.push_back(Meeting({0, 4}, {1, 4}, 7.5));
  EXPECT_EQ(ChooseClosures(with_rival, ways_, options_, all).believed.size(), 8U) << "one is none";
  with_rival.push_back(Meeting({0, 6}, {1, 6}, 7.5));
  EXPECT_EQ(ChooseClosures(with_rival, ways_, options_, all).believed.size(), 6U);
  found[1] = Meeting({0, 1}, {1, 2});
  EXPECT_EQ(ChooseClosures(found, ways_, options_, all).believed.size(), 6U)
      << "both are of one place";
}

// A piece behind a jump is held by nothing but them.
TEST_F(ClosureChoiceTest, WithinASessionTwoAreNotEnough) {
  for (std::size_t i = 5; i < kSubmaps; ++i) {
    ways_[1].T_session_submap[i] = At(11.0 * static_cast<double>(i - 5), 0.2);
  }
  const IsAsKnown all = [](const FoundClosure&) {
    return true;
  };
  std::vector<FoundClosure> found;
  for (const std::size_t i : {0U, 2U}) found.push_back(Found({1, i}, {1, i + 5}, At(0.0)));
  EXPECT_TRUE(ChooseClosures(found, ways_, options_, all).believed.empty());
  found.push_back(Found({1, 4}, {1, 9}, At(0.0)));
  EXPECT_EQ(ChooseClosures(found, ways_, options_, all).believed.size(), 3U);
}

// Nobody is known by two closures alone, however many such meetings lead around to him.
TEST_F(ClosureChoiceTest, TwosDoNotVouchForEachOther) {
  std::vector<FoundClosure> found;
  for (const std::size_t i : {0U, 1U}) {
    for (const auto& [a, b] : {std::pair(0U, 1U), std::pair(0U, 2U), std::pair(1U, 2U)}) {
      found.push_back(Meeting({a, i}, {b, i}));
    }
  }
  const IsAsKnown all = [](const FoundClosure&) {
    return true;
  };
  EXPECT_TRUE(ChooseClosures(found, ways_, options_, all).believed.empty());
}

TEST_F(ClosureChoiceTest, TooFewAreNot) {
  const ClosureChoice choice = Choose({Meeting({0, 1}, {1, 1}), Meeting({0, 3}, {1, 3})});
  EXPECT_TRUE(choice.believed.empty());
  EXPECT_EQ(choice.rejected.size(), 2U);
  ASSERT_EQ(choice.meetings.size(), 1U);
  EXPECT_FALSE(choice.meetings[0].is_believed);
  EXPECT_EQ(choice.meetings[0].agreeing, 2U);
  EXPECT_EQ(choice.meetings[0].margin, 0.0);
}

// One submap that fits three is one place, whichever session it is of.
TEST_F(ClosureChoiceTest, ManyOfOneSubmapAreOnePlace) {
  EXPECT_TRUE(Choose({Meeting({0, 4}, {1, 3}), Meeting({0, 4}, {1, 4}), Meeting({0, 4}, {1, 5}),
                      Meeting({0, 4}, {1, 6})})
                  .believed.empty());
  EXPECT_TRUE(Choose({Meeting({0, 3}, {1, 4}), Meeting({0, 4}, {1, 4}), Meeting({0, 5}, {1, 4}),
                      Meeting({0, 6}, {1, 4})})
                  .believed.empty());
  EXPECT_EQ(Choose({Meeting({0, 3}, {1, 3}), Meeting({0, 4}, {1, 4}), Meeting({0, 5}, {1, 4}),
                    Meeting({0, 6}, {1, 6})})
                .believed.size(),
            4U);
}

TEST_F(ClosureChoiceTest, ARivalAsGoodAsItselfIsDoubt) {
  std::vector<FoundClosure> found;
  for (const std::size_t i : {0U, 2U, 4U}) {
    found.push_back(Meeting({0, i}, {1, i}));
    found.push_back(Meeting({0, i + 1}, {1, i + 1}, 7.5));
  }
  EXPECT_TRUE(Choose(found).believed.empty());
  EXPECT_NEAR(Choose(found).meetings[0].margin, 1.0, 1e-9);
  found.push_back(Meeting({0, 8}, {1, 8}));  // 4 against 3: 1.33
  const ClosureChoice choice = Choose(found);
  EXPECT_EQ(choice.believed.size(), 4U);
  EXPECT_NEAR(choice.meetings[0].margin, 4.0 / 3.0, 1e-9);
  options_.min_margin = 1.4;
  EXPECT_TRUE(Choose(found).believed.empty());
}

// What would not be believed alone is no rival, whatever it weighs.
TEST_F(ClosureChoiceTest, ARivalTooSmallIsNone) {
  std::vector<FoundClosure> found;
  for (const std::size_t i : {0U, 2U, 4U}) found.push_back(Meeting({0, i}, {1, i}, 0.0, 0.4));
  for (const std::size_t i : {1U, 3U}) found.push_back(Meeting({0, i}, {1, i}, 7.5, 0.5));
  const ClosureChoice choice = Choose(found);
  EXPECT_LT(choice.meetings[0].margin, options_.min_margin);
  EXPECT_EQ(choice.believed.size(), 3U);
}

TEST_F(ClosureChoiceTest, PairsOfSessionsAreJudgedEachAlone) {
  const ClosureChoice choice =
      Choose({Meeting({1, 1}, {2, 1}, 30.0), Meeting({0, 1}, {1, 1}), Meeting({1, 2}, {2, 2}, 30.0),
              Meeting({0, 2}, {1, 2}), Meeting({0, 4}, {2, 4}), Meeting({0, 3}, {1, 3}),
              Meeting({1, 3}, {2, 3}, 30.0)});
  ASSERT_EQ(choice.meetings.size(), 3U);
  EXPECT_EQ(choice.meetings[0].b, 1U);
  EXPECT_TRUE(choice.meetings[0].is_believed);
  EXPECT_EQ(choice.meetings[1].a, 0U);
  EXPECT_EQ(choice.meetings[1].b, 2U);
  EXPECT_FALSE(choice.meetings[1].is_believed);
  EXPECT_EQ(choice.meetings[2].a, 1U);
  EXPECT_TRUE(choice.meetings[2].is_believed);
  EXPECT_EQ(choice.believed.size(), 6U);
  EXPECT_EQ(choice.rejected.size(), 1U);
}

TEST_F(ClosureChoiceTest, ASessionMeetsItself) {
  for (std::size_t i = 5; i < kSubmaps; ++i) {
    ways_[1].T_session_submap[i] = At(11.0 * static_cast<double>(i - 5), 0.2);  // a second time
  }
  std::vector<FoundClosure> found;
  for (const std::size_t i : {0U, 2U, 4U}) found.push_back(Found({1, i}, {1, i + 5}, At(0.0)));
  const ClosureChoice choice = Choose(found);
  EXPECT_EQ(choice.believed.size(), 3U);
  EXPECT_EQ(choice.meetings[0].a, 1U);
  EXPECT_EQ(choice.meetings[0].b, 1U);
}

// Which explain no more than they contradict.
TEST_F(ClosureChoiceTest, WhatExplainsNothingMakesNoNumberThatIsNone) {
  const ClosureChoice choice =
      Choose({Meeting({0, 1}, {1, 1}, 0.0, 0.0), Meeting({0, 2}, {1, 2}, 9.0, 0.0)});
  EXPECT_TRUE(choice.believed.empty());
  EXPECT_EQ(choice.rejected.size(), 2U);
  EXPECT_EQ(choice.meetings[0].agreeing, 1U);
  EXPECT_EQ(choice.meetings[0].margin, 0.0);
}

}  // namespace
}  // namespace atlas
