#include "server/base/thread_priority.h"

#include <algorithm>

#include <sys/resource.h>
#include <unistd.h>

namespace atlas {
namespace {

constexpr int kNicest = 19;

}  // namespace

// On Linux the priority of a "process" is that of the one thread with this number; 0 is the caller.
bool YieldToOthers(int steps) {
  const int of_process = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::getpid()));
  return ::setpriority(PRIO_PROCESS, 0, std::min(of_process + steps, kNicest)) == 0;
}

}  // namespace atlas
