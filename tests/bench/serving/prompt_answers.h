// How long somebody waits who asks for little, one thing at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/status.h"

namespace atlas::testing {

// Of each request for the status, ms.
Result<std::vector<double>> TimeStatus(std::uint16_t port, std::chrono::milliseconds time);

// Until each of small keyframes is on disk, ms. All lie in one tile of wide_atlas, in `session`,
// under which nobody uploaded yet.
Result<std::vector<double>> TimeUploads(std::uint16_t port,
                                        std::chrono::milliseconds time,
                                        const std::string& session);

}  // namespace atlas::testing
