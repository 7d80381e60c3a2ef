#include "server/base/thread_priority.h"

#include <algorithm>
#include <cstdint>
#include <fstream>

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

namespace atlas {
namespace {

constexpr int kNicest = 19;

}  // namespace

// On Linux both are of the one thread, 0 is the caller.
bool YieldToOthers(int steps) {
  if (steps >= kNicest) {
    const sched_param none{};
    return ::sched_setscheduler(0, SCHED_IDLE, &none) == 0;
  }
  const int of_process = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::getpid()));
  return ::setpriority(PRIO_PROCESS, 0, std::min(of_process + steps, kNicest)) == 0;
}

std::chrono::nanoseconds TimeWithoutCore() {
  std::int64_t on_core_ns = 0;
  std::int64_t waiting_ns = 0;
  std::ifstream file("/proc/thread-self/schedstat");
  file >> on_core_ns >> waiting_ns;
  return std::chrono::nanoseconds(file ? waiting_ns : 0);
}

}  // namespace atlas
