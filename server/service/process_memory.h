// What this process occupies.
#pragma once

#include <cstdint>

namespace atlas {

// Resident set size from /proc/self/statm; 0 where there is none.
std::uint64_t ResidentBytes();

// From now on large blocks go back to the system as soon as they are freed. To be called first: the
// surveys of tiles come and go, and what they leave free between others that stay would count as
// occupied for ever.
void ReturnLargeBlocks();
// What is free between blocks that stay goes back as well. Takes milliseconds, and again some when
// it is used the next time.
void ReturnFreeMemory();

}  // namespace atlas
