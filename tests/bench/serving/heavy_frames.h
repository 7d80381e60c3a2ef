// Requests that keep to every rule and cost as much as one can.
#pragma once

#include <cstdint>

#include "core/base/bytes.h"

namespace atlas::testing {

// Corrections of as many poses as there may be in one, some 20 MB; the last one is impossible, so
// that all are read and nothing changes.
Bytes ManyPosesFrame(std::uint64_t request_id);
// A sync of little, by somebody who holds as many tiles and blocks as there may be.
Bytes ManyHeldFrame(std::uint64_t request_id);
// The same of an area that has what is held: the reply says of all of it that it is no more.
Bytes ManyHeldInAreaFrame(std::uint64_t request_id);
// A sync of all within 1.5 km of a route of 256 points at random, which takes long to plan.
Bytes WideCorridorFrame(std::uint64_t request_id);
// A watch of as many tiles as there may be.
Bytes ManyWatchedFrame(std::uint64_t request_id);

}  // namespace atlas::testing
