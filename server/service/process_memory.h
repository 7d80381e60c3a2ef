// What this process occupies.
#pragma once

#include <cstdint>

namespace atlas {

// Resident set size from /proc/self/statm; 0 where there is none.
std::uint64_t ResidentBytes();

// What is free goes back to the system at once. Takes milliseconds, and again some when it is used
// the next time.
void ReturnFreeMemory();

}  // namespace atlas
