#include "server/net/connection/large_parts.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

using std::chrono::seconds;

class LargePartsTest : public testing::Test {
 protected:
  struct Peer {
    explicit Peer(LargeParts& parts) : part(parts, [this] { ++closed; }) {}

    int closed = 0;
    LargeParts::Part part;
  };

  const LargeParts::Time start_{};
  LargeParts parts_{1'000};
  Peer stalled_{parts_};
  Peer slow_{parts_};
  Peer fast_{parts_};
};

TEST_F(LargePartsTest, WhoeverIsClosestToItsDeadlineGoes) {
  EXPECT_TRUE(slow_.part.Set(400, start_ + seconds(20)));
  EXPECT_TRUE(stalled_.part.Set(400, start_ + seconds(10)));
  EXPECT_TRUE(fast_.part.Set(400, start_ + seconds(30)));
  EXPECT_EQ(stalled_.closed, 1);
  EXPECT_EQ(slow_.closed, 0);
  EXPECT_EQ(fast_.closed, 0);
  EXPECT_EQ(parts_.closed(), 1u);
}

TEST_F(LargePartsTest, NoMoreGoThanMakeRoom) {
  EXPECT_TRUE(stalled_.part.Set(400, start_ + seconds(10)));
  EXPECT_TRUE(slow_.part.Set(500, start_ + seconds(20)));
  EXPECT_TRUE(fast_.part.Set(400, start_ + seconds(30)));
  EXPECT_TRUE(fast_.part.Set(500, start_ + seconds(30))) << "the one that closes counts no more";
  EXPECT_EQ(stalled_.closed, 1);
  EXPECT_EQ(slow_.closed, 0);
}

TEST_F(LargePartsTest, TheSlowestIsNotGivenMore) {
  EXPECT_TRUE(fast_.part.Set(800, start_ + seconds(30)));
  EXPECT_FALSE(slow_.part.Set(400, start_ + seconds(20)));
  EXPECT_EQ(fast_.closed, 0);
}

TEST_F(LargePartsTest, WhatIsWholeStays) {
  EXPECT_TRUE(stalled_.part.Set(800, LargeParts::Time::max()));
  EXPECT_FALSE(fast_.part.Set(400, start_ + seconds(30)));
  EXPECT_EQ(stalled_.closed, 0);
}

TEST_F(LargePartsTest, WhatWasReadOrIsGoneMakesRoom) {
  EXPECT_TRUE(stalled_.part.Set(800, start_ + seconds(10)));
  EXPECT_TRUE(stalled_.part.Set(0, start_ + seconds(10)));
  {
    Peer gone(parts_);
    EXPECT_TRUE(gone.part.Set(900, start_ + seconds(10)));
  }
  EXPECT_TRUE(fast_.part.Set(1'000, start_ + seconds(30)));
  EXPECT_EQ(parts_.closed(), 0u);
}

}  // namespace
}  // namespace atlas
