// How a published standard deviation is rounded: to five significant bits, 3 % at most, so that it
// is one byte in a tile instead of half of its bytes (docs/formats/tile.md). Frozen.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace atlas {

inline constexpr std::uint8_t kMaxSigmaCode = 207;

// 0..31 stand for themselves; above, 16 codes an octave.
constexpr std::uint16_t SigmaOfCode(std::uint8_t code) {
  if (code < 32) {
    return code;
  }
  const unsigned octave = (code - 32u) / 16;
  return static_cast<std::uint16_t>((16u + (code - 32u) % 16) << (octave + 1));
}

// The code whose sigma is nearest, the larger one of two; beyond the last: the last.
constexpr std::uint8_t CodeOfSigma(std::uint64_t sigma_100um) {
  const std::uint64_t sigma = std::min<std::uint64_t>(sigma_100um, SigmaOfCode(kMaxSigmaCode));
  if (sigma < 32) {
    return static_cast<std::uint8_t>(sigma);
  }
  const auto shift = static_cast<unsigned>(std::bit_width(sigma)) - 5;
  const std::uint64_t mantissa = (sigma + (std::uint64_t{1} << (shift - 1))) >> shift;  // 16..32
  return static_cast<std::uint8_t>(32 + (shift - 1) * 16 + (mantissa - 16));
}

// Never 0: every altitude is uncertain.
constexpr std::uint16_t RoundSigma100um(std::uint64_t sigma_100um) {
  return SigmaOfCode(CodeOfSigma(std::max<std::uint64_t>(sigma_100um, 1)));
}

}  // namespace atlas
