// What a submap was fused of. Two of one name are the same on every machine.
#pragma once

#include <compare>
#include <cstdint>

namespace atlas {

struct SubmapName {
  std::uint64_t content = 0;  // Hash64 of its keyframes and of how they were fused
  std::uint64_t shape = 0;    // and of how these lie to each other

  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 sees a null pointer in <=>
  friend auto operator<=>(const SubmapName&, const SubmapName&) = default;
};

}  // namespace atlas
