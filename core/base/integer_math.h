// Integer arithmetic with stated rounding, for the paths where every machine must agree.
#pragma once

#include <cstdint>

namespace atlas {

// 128-bit integers for products of 64-bit ones.
__extension__ using Int128 = __int128;

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
  const Int128 quotient = shifted / b;
  return static_cast<std::int64_t>(quotient - static_cast<Int128>(shifted % b < 0));
}

// floor(sqrt(value)).
constexpr std::uint64_t Isqrt(std::uint64_t value) {
  std::uint64_t result = 0;
  std::uint64_t bit = std::uint64_t{1} << 62;
  while (bit > value) {
    bit >>= 2;
  }
  while (bit != 0) {
    if (value >= result + bit) {
      value -= result + bit;
      result = (result >> 1) + bit;
    } else {
      result >>= 1;
    }
    bit >>= 2;
  }
  return result;
}

}  // namespace atlas
