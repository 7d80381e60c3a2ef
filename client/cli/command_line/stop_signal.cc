#include "client/cli/command_line/stop_signal.h"

#include <algorithm>

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;

bool IsIgnored(int number) {
  struct sigaction action {};
  return sigaction(number, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

timespec SpanUntil(Clock::time_point end) {
  const auto left = std::max(end - Clock::now(), Clock::duration::zero());
  const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
  timespec span{};
  span.tv_sec = static_cast<time_t>(seconds.count());
  span.tv_nsec = static_cast<long>(std::chrono::nanoseconds(left - seconds).count());
  return span;
}

}  // namespace

StopSignal::StopSignal() {
  sigemptyset(&signals_);
  for (const int number : {SIGINT, SIGTERM}) {
    if (!IsIgnored(number)) sigaddset(&signals_, number);
  }
  pthread_sigmask(SIG_BLOCK, &signals_, &before_);
}

StopSignal::~StopSignal() {
  // Others that came are of no more use: it ends.
  const timespec none{};
  while (sigtimedwait(&signals_, nullptr, &none) > 0) {
  }
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

bool StopSignal::HasCome() {
  Sleep(std::chrono::milliseconds(0));
  return has_come_;
}

void StopSignal::Sleep(std::chrono::milliseconds time) {
  const Clock::time_point end = Clock::now() + time;
  while (!has_come_) {
    const timespec span = SpanUntil(end);
    if (sigtimedwait(&signals_, nullptr, &span) > 0) has_come_ = true;
    if (Clock::now() >= end) return;
  }
}

}  // namespace atlas
