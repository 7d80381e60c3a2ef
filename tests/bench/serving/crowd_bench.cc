// A crowd of connections to a daemon, beside which a good client is measured.
// Usage: crowd_bench PORT IDLE SLOW HOSTILE HOW [tls|token TOKEN]
// HOW: breaks_rules, asks_much, asks_wide, never_reads or holds_unread. TOKEN: of the hostile ones.
// Says {"open": N} when those that keep to the rules are connected, then lets the hostile ones go
// until its standard input ends, and checks that the others have lost nothing.
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include <poll.h>

#include "tests/bench/serving/hostile_crowd.h"
#include "tests/bench/serving/quiet_crowd.h"

namespace atlas::testing {
namespace {

constexpr int kTick_ms = 10;

bool IsToldToEnd() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  return ::poll(&input, 1, kTick_ms) > 0;
}

std::size_t CountOf(const char* text) {
  return static_cast<std::size_t>(std::atoi(text));
}

Hostility HostilityOf(const std::string& name) {
  if (name == "asks_much") {
    return Hostility::kAskMuch;
  }
  if (name == "asks_wide") {
    return Hostility::kAskWide;
  }
  if (name == "holds_unread") {
    return Hostility::kHoldUnread;
  }
  return name == "never_reads" ? Hostility::kNeverRead : Hostility::kBreakRules;
}

Status Run(int argc, char** argv) {
  const bool with_tls = argc == 7 && argv[6] == std::string("tls");
  const bool with_token = argc == 8 && argv[6] == std::string("token");
  if (argc != 6 && !with_tls && !with_token) {
    return {StatusCode::kInvalidArgument,
            "usage: crowd_bench PORT IDLE SLOW HOSTILE "
            "breaks_rules|asks_much|asks_wide|never_reads|holds_unread [tls|token TOKEN]"};
  }
  const Hostility how = HostilityOf(argv[5]);
  const auto port = static_cast<std::uint16_t>(std::atoi(argv[1]));
  std::optional<LoadTls> tls;
  const LoadTls* const way = with_tls ? &tls.emplace() : nullptr;
  QuietCrowd quiet(port, way);
  ATLAS_RETURN_IF_ERROR(quiet.Open(CountOf(argv[2]), CountOf(argv[3])));
  std::cout << "{\"open\": " << CountOf(argv[2]) + CountOf(argv[3]) << "}" << std::endl;
  HostileCrowd hostile(port, way, with_token ? argv[7] : "", CountOf(argv[4]), how);
  while (!IsToldToEnd()) {
    ATLAS_RETURN_IF_ERROR(quiet.Tick());
  }
  hostile.Stop();
  ATLAS_RETURN_IF_ERROR(quiet.CheckAll());
  std::cout << "{\"slow_replies\": " << quiet.slow_replies() << ", \"visits\": " << hostile.visits()
            << ", \"refused\": " << hostile.refused() << "}" << std::endl;
  return {};
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to a daemon that is gone, too
  const atlas::Status status = atlas::testing::Run(argc, argv);
  if (!status.ok()) {
    std::cerr << "crowd_bench: " << status.message() << "\n";
  }
  return status.ok() ? 0 : 1;
}
