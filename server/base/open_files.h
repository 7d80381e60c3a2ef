// How many files and connections the process may have open.
#pragma once

#include <cstddef>

namespace atlas {

// Asks the system for `wanted`, or as many as it lets the process have; how many it may have now,
// never fewer than before.
std::size_t AllowOpenFiles(std::size_t wanted);

}  // namespace atlas
