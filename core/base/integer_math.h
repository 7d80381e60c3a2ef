// Integer arithmetic with stated rounding, for the paths where every machine must agree.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace atlas {

// 128-bit integers for products of 64-bit ones.
__extension__ using Int128 = __int128;
__extension__ using Uint128 = unsigned __int128;

// floor(a / b), b > 0.
constexpr std::int64_t FloorDiv(std::int64_t a, std::int64_t b) {
  const std::int64_t quotient = a / b;
  return quotient - static_cast<std::int64_t>(a % b < 0);
}

// a / b rounded to nearest, halves up (towards +infinity), b > 0.
constexpr std::int64_t RoundDiv(std::int64_t a, std::int64_t b) {
  return FloorDiv(a + b / 2, b);
}

constexpr std::int64_t RoundDiv128(Int128 a, std::int64_t b) {
  const Int128 shifted = a + b / 2;
  if (shifted == static_cast<std::int64_t>(shifted)) {  // much faster, and usual
    return FloorDiv(static_cast<std::int64_t>(shifted), b);
  }
  const Int128 quotient = shifted / b;
  return static_cast<std::int64_t>(quotient - static_cast<Int128>(shifted % b < 0));
}

// floor(sqrt(value)).
inline std::uint64_t Isqrt(std::uint64_t value) {
  constexpr std::uint64_t kMax = 0xFFFF'FFFF;
  // A floating-point guess, put right in integers: the same everywhere, however it was rounded.
  auto root = std::min(static_cast<std::uint64_t>(std::sqrt(static_cast<double>(value))), kMax);
  while (root * root > value) {
    --root;
  }
  while (root < kMax && (root + 1) * (root + 1) <= value) {
    ++root;
  }
  return root;
}

}  // namespace atlas
