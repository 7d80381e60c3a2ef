// What is told of returns that are none.
#pragma once

#include <cstdint>

#include "client/cli/output/text_table.h"

namespace atlas {

// A line, where there are such.
void AddDropped(std::uint64_t dropped_returns, FactList& facts);

}  // namespace atlas
