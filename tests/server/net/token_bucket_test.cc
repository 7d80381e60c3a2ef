#include "server/net/connection/token_bucket.h"

#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(TokenBucketTest, ASecondsWorthComesAtOnceAndTheRestWaits) {
  TokenBucket bucket(10.0);
  const TokenBucket::Time start{seconds(1'000)};
  EXPECT_EQ(bucket.Take(10.0, start), seconds(0));
  EXPECT_EQ(bucket.Take(5.0, start), milliseconds(500));
  EXPECT_EQ(bucket.Take(0.0, start + milliseconds(500)), seconds(0));
  EXPECT_EQ(bucket.Take(20.0, start + seconds(100)), seconds(1)) << "idle time buys no more";
}

TEST(TokenBucketTest, ARateThatChangesLeavesWhatIsOwed) {
  TokenBucket bucket(10.0);
  const TokenBucket::Time start{seconds(1'000)};
  EXPECT_EQ(bucket.Take(15.0, start), milliseconds(500));
  bucket.set_rate(5.0);
  EXPECT_EQ(bucket.Take(0.0, start), seconds(1));
}

TEST(TokenBucketTest, WhoeverWaitsKeepsToTheRate) {
  std::mt19937 random(5);
  TokenBucket bucket(1'000.0);
  const TokenBucket::Time start{seconds(1'000)};
  TokenBucket::Time now = start;
  double taken = 0.0;
  for (int i = 0; i < 10'000; ++i) {
    const auto amount = static_cast<double>(random() % 300);
    taken += amount;
    now += bucket.Take(amount, now);
  }
  const std::chrono::duration<double> passed = now - start;
  EXPECT_NEAR(taken / (passed.count() + 1.0), 1'000.0, 5.0);
}

TEST(TokenBucketTest, NoneIsNoLimit) {
  TokenBucket bucket(0.0);
  EXPECT_EQ(bucket.Take(1e12, TokenBucket::Time{}), seconds(0));
}

TEST(TokenBucketTest, WhereThereIsNoLimitAnyMoreNothingIsOwed) {
  TokenBucket bucket(10.0);
  const TokenBucket::Time start{seconds(1'000)};
  bucket.Take(1'000.0, start);
  EXPECT_FALSE(bucket.IsFull(start + seconds(1)));
  bucket.set_rate(0.0);
  EXPECT_TRUE(bucket.IsFull(start + seconds(1)));
}

}  // namespace
}  // namespace atlas
