#include "server/net/connection/newcomers.h"

#include <map>
#include <string>

#include <gtest/gtest.h>

namespace atlas {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Newcomers::Time kNow{std::chrono::hours(1)};

// How many of this address find a place.
int EnterAll(Newcomers& newcomers, const std::string& address) {
  int entered = 0;
  while (newcomers.Enter(address, kNow)) {
    ++entered;
  }
  return entered;
}

TEST(NewcomersTest, AnAddressHasAnEighthOfWhatIsLeft) {
  Newcomers newcomers({2'048, 0, 100});
  EXPECT_EQ(EnterAll(newcomers, "a"), 227);
  EXPECT_EQ(EnterAll(newcomers, "b"), 202);
  EXPECT_FALSE(newcomers.Enter("a", kNow));
  newcomers.Leave("b");
  EXPECT_TRUE(newcomers.Enter("b", kNow));
  EXPECT_EQ(newcomers.open(), 227u + 202u);
}

TEST(NewcomersTest, HoweverManyTakeAllTheyCanWhoIsNewFindsAsMuch) {
  Newcomers newcomers({2'048, 0, 1'000});
  std::map<std::string, int> there;
  for (int round = 0; round < 200; ++round) {  // places come free now and then, and are taken again
    for (int i = 0; i < 300; ++i) {
      const std::string address = std::to_string(i);
      int& open = there[address];
      if (open > 0) {
        newcomers.Leave(address);
        --open;
      }
      open += EnterAll(newcomers, address);
    }
  }
  EXPECT_GE(EnterAll(newcomers, "new"), 4) << "of 2,048 / (8 + 301)";
}

TEST(NewcomersTest, AllTogetherHaveNoMoreThanThereIs) {
  Newcomers newcomers({4, 0, 100});
  EXPECT_EQ(EnterAll(newcomers, ""), 4) << "of this machine: no limit of its own";
  EXPECT_FALSE(newcomers.Enter("a", kNow));
  newcomers.Leave("");
  EXPECT_TRUE(newcomers.Enter("a", kNow));
}

TEST(NewcomersTest, WhoOwesDoesNotEnterUntilItIsPaid) {
  Newcomers newcomers({100, 10, 100});
  newcomers.Charge("a", 10, kNow);
  EXPECT_TRUE(newcomers.Enter("a", kNow)) << "a second's worth is free";
  newcomers.Charge("a", 5, kNow);
  EXPECT_FALSE(newcomers.Enter("a", kNow));
  EXPECT_TRUE(newcomers.Enter("b", kNow));
  EXPECT_FALSE(newcomers.Enter("a", kNow + milliseconds(400)));
  EXPECT_TRUE(newcomers.Enter("a", kNow + milliseconds(600)));
}

TEST(NewcomersTest, WhoComesAgainOwesWhatItOwed) {
  Newcomers newcomers({100, 10, 100});
  EXPECT_TRUE(newcomers.Enter("a", kNow));
  newcomers.Charge("a", 15, kNow);
  newcomers.Leave("a");
  EXPECT_TRUE(newcomers.Enter("b", kNow));
  EXPECT_FALSE(newcomers.Enter("a", kNow));
}

TEST(NewcomersTest, WhoHasPaidIsForgotten) {
  Newcomers newcomers({100, 10, 100});
  for (int i = 0; i < 50; ++i) {
    const std::string address = std::to_string(i);
    EXPECT_TRUE(newcomers.Enter(address, kNow));
    newcomers.Charge(address, 1, kNow);
    newcomers.Leave(address);
  }
  EXPECT_EQ(newcomers.addresses(), 50u);
  for (int i = 0; i < 50; ++i) {
    EXPECT_TRUE(newcomers.Enter("a", kNow + seconds(1)));
    newcomers.Leave("a");
  }
  EXPECT_LE(newcomers.addresses(), 2u);
}

TEST(NewcomersTest, NoMoreThanSoManyAreRemembered) {
  Newcomers newcomers({100, 10, 20});
  EXPECT_TRUE(newcomers.Enter("here", kNow));
  for (int i = 0; i < 1'000; ++i) {
    const std::string address = std::to_string(i);
    EXPECT_TRUE(newcomers.Enter(address, kNow));
    newcomers.Charge(address, 100, kNow);
    newcomers.Leave(address);
    EXPECT_LE(newcomers.addresses(), 22u);
  }
  newcomers.Leave("here");
  EXPECT_EQ(newcomers.open(), 0u);
}

}  // namespace
}  // namespace atlas
