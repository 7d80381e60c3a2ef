// Peers that change the keys of their TLS connection: now and then, and without end.
#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <regex>
#include <sstream>
#include <string>

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

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

// Of records of some lengths OpenSSL's buffer never ends with a whole one.
TEST_F(TlsTest, WhoChangesKeysAllAtOnceIsClosedSoonWhateverTheirLength) {
  constexpr int kMany = 3'000;
  const auto before = spdlog::default_logger();
  std::ostringstream log;
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "atlasd", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  net_.threads = 1;
  net_.max_log_lines_per_s = 1'000;  // all
  ServeTls();
  for (std::size_t padding = 0; padding < 140; ++padding) {
    BlockingPeer other(port_, Anonymous());
    other.FloodWithKeyChanges(kMany, padding);
    EXPECT_TRUE(other.IsClosed());
  }
  StopServer();
  spdlog::set_default_logger(before);
  const std::regex line(": TLS: ([0-9]+) changes of the key");
  const std::string text = log.str();
  int closed = 0;
  for (std::sregex_iterator found(text.begin(), text.end(), line), end; found != end; ++found) {
    ++closed;
    EXPECT_LT(std::stoi((*found)[1]), 700);  // what one buffer holds
  }
  EXPECT_EQ(closed, 140);
}

}  // namespace
}  // namespace atlas
