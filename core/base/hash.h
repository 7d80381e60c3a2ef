// 64-bit content hash (XXH64, seed 0): checksums, not secrets.
#pragma once

#include <cstdint>

#include "core/base/bytes.h"

namespace atlas {

std::uint64_t Hash64(ByteSpan bytes);

}  // namespace atlas
