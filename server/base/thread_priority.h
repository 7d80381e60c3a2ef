// How much of a busy machine a thread gets beside the others.
#pragma once

namespace atlas {

// From now on the calling thread is nicer than the process by `steps` of nice(2), 0 to 19, as far
// as there are any. False: the system does not let it be, and it goes on as it was.
bool YieldToOthers(int steps);

}  // namespace atlas
