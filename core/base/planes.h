// Numbers as they compress best: zigzag differences split into one plane a byte, nibbles and bits
// packed. Every reader fails its ByteReader on missing bytes and on non-zero padding, so that equal
// values have exactly one encoding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/bytes.h"

namespace atlas {

// 0, -1, 1, -2 ... -> 0, 1, 2, 3 ...
constexpr std::uint32_t Zigzag(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1) ^ static_cast<std::uint32_t>(value >> 31);
}
constexpr std::int32_t Unzigzag(std::uint32_t bits) {
  return static_cast<std::int32_t>((bits >> 1) ^ (~(bits & 1) + 1));
}

// All lowest bytes, then all second bytes, ...: `planes` (1..4) times the number of values.
void WritePlanes(std::span<const std::uint32_t> values, int planes, ByteWriter& out);
std::vector<std::uint32_t> ReadPlanes(ByteReader& in, std::size_t count, int planes);

// Two values of 0..15 a byte, low nibble first.
void WriteNibbles(std::span<const std::uint8_t> values, ByteWriter& out);
std::vector<std::uint8_t> ReadNibbles(ByteReader& in, std::size_t count);

// Eight values of 0 or 1 a byte, lowest bit first.
void WriteBits(std::span<const std::uint8_t> values, ByteWriter& out);
std::vector<std::uint8_t> ReadBits(ByteReader& in, std::size_t count);

// Nibble k of every word, packed as by WriteNibbles, then nibble k + 1, ... `nibbles` (0..16) of
// them. Reading adds into `words`, which are zero.
void WriteNibblePlanes(std::span<const std::uint64_t> words, int nibbles, ByteWriter& out);
void ReadNibblePlanes(ByteReader& in, int nibbles, std::span<std::uint64_t> words);

}  // namespace atlas
