// What this process occupies.
#pragma once

#include <cstdint>

namespace atlas {

// Resident set size from /proc/self/statm; 0 where there is none.
std::uint64_t ResidentBytes();

}  // namespace atlas
