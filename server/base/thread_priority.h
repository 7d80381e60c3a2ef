// How much of a busy machine a thread gets beside the others.
#pragma once

#include <chrono>

namespace atlas {

// From now on the calling thread is nicer than the process by `steps` of nice(2), 0 to 18, as far
// as there are any; by 19 it gets what nobody else wants (SCHED_IDLE): a nice thread is not taken
// off its core as soon as another one wakes up, an idle one is. False: the system does not let it
// be, and it goes on as it was.
bool YieldToOthers(int steps);

// How long the calling thread has been ready to run and without a core, since it began; 0 where the
// system does not say (schedstat, proc(5)).
std::chrono::nanoseconds TimeWithoutCore();

}  // namespace atlas
