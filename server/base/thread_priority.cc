#include "server/base/thread_priority.h"

#include <algorithm>

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

}  // namespace atlas
