// CPU time of the calling thread: what a computation costs, whatever else the machine does.
#pragma once

#include <ctime>

namespace atlas {

class CpuTimer {
 public:
  CpuTimer() : start_s_(Now()) {}
  double elapsed_s() const { return Now() - start_s_; }

 private:
  static double Now() {
    std::timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

  double start_s_;
};

}  // namespace atlas
