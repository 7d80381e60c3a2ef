// Peers that change the keys of their TLS connection: now and then, and without end.
#include <algorithm>
#include <chrono>
#include <future>

#include "tests/server/net/tls_fixture.h"

namespace atlas {
namespace {

TEST_F(TlsTest, KeysMayChangeNowAndThen) {
  ServeTls();
  BlockingPeer car(port_, As("car.7"));
  EXPECT_TRUE(car.ChangeKeys(5));
  EXPECT_TRUE(car.Greet().has_hello_reply());
  EXPECT_TRUE(car.ChangeKeys(5));
  EXPECT_EQ(Ask(car, StatusOf(3)), StatusCode::kOk);
}

// Each change costs the daemon far more than the peer; and nothing that counts as sent comes of it.
TEST_F(TlsTest, WhoChangesKeysWithoutEndIsClosedAndHoldsUpNobody) {
  net_.threads = 1;
  ServeTls();
  BlockingPeer good(port_, As("car.7"));
  ASSERT_TRUE(good.Greet().has_hello_reply());
  std::future<int> closed = std::async(std::launch::async, [this] {
    int times = 0;
    for (int i = 0; i < 10; ++i) {
      BlockingPeer other(port_, Anonymous());
      const auto begin = std::chrono::steady_clock::now();
      while (other.ChangeKeys(1'000) &&
             std::chrono::steady_clock::now() < begin + std::chrono::seconds(3)) {
      }
      times += std::chrono::steady_clock::now() < begin + std::chrono::seconds(3);
    }
    return times;
  });
  auto longest = std::chrono::steady_clock::duration::zero();
  while (closed.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    const auto begin = std::chrono::steady_clock::now();
    ASSERT_EQ(Ask(good, StatusOf(3)), StatusCode::kOk);
    longest = std::max(longest, std::chrono::steady_clock::now() - begin);
  }
  EXPECT_EQ(closed.get(), 10);
  EXPECT_LT(longest, std::chrono::seconds(1));
}

}  // namespace
}  // namespace atlas
