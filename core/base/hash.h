// 64-bit content hash (XXH64, seed 0): checksums, not secrets.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/bytes.h"

namespace atlas {

std::uint64_t Hash64(ByteSpan bytes);

// The same over bytes that come in pieces. A copy goes on from where it was made.
class Hash64Stream {
 public:
  Hash64Stream();

  void Add(ByteSpan bytes);
  std::uint64_t value() const;

 private:
  std::array<std::uint64_t, 11> state_;  // an XXH64_state_t
};

}  // namespace atlas
