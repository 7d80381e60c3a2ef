// Golden files: bytes that a released version wrote and every later one must still read.
#pragma once

#include <string>

#include "core/base/bytes.h"

namespace atlas::testing {

std::string GoldenPath(const std::string& name);

// The content of tests/golden/NAME; empty: there is none.
Bytes GoldenFile(const std::string& name);

// The same of today's version. With ATLAS_WRITE_GOLDEN set in the environment `fresh` is written
// there first: for a new format version, never for an old one.
Bytes GoldenFile(const std::string& name, ByteSpan fresh);

}  // namespace atlas::testing
