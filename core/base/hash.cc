#include "core/base/hash.h"

#include <xxhash.h>

namespace atlas {

std::uint64_t Hash64(ByteSpan bytes) {
  return XXH64(bytes.data(), bytes.size(), 0);
}

}  // namespace atlas
