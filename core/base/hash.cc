#include "core/base/hash.h"

#include <cstring>
#include <type_traits>

#define XXH_STATIC_LINKING_ONLY  // the state's size
#include <xxhash.h>

namespace atlas {

std::uint64_t Hash64(ByteSpan bytes) {
  return XXH64(bytes.data(), bytes.size(), 0);
}

Hash64Stream::Hash64Stream() {  // NOLINT(cppcoreguidelines-pro-type-member-init)
  static_assert(std::is_trivially_copyable_v<XXH64_state_t>);
  static_assert(sizeof(XXH64_state_t) == sizeof(state_));
  XXH64_state_t state;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  XXH64_reset(&state, 0);
  std::memcpy(state_.data(), &state, sizeof(state));
}

void Hash64Stream::Add(ByteSpan bytes) {
  XXH64_state_t state;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  std::memcpy(&state, state_.data(), sizeof(state));
  XXH64_update(&state, bytes.data(), bytes.size());
  std::memcpy(state_.data(), &state, sizeof(state));
}

std::uint64_t Hash64Stream::value() const {
  XXH64_state_t state;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  std::memcpy(&state, state_.data(), sizeof(state));
  return XXH64_digest(&state);
}

}  // namespace atlas
