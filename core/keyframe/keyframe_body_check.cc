#include "core/keyframe/keyframe_body_check.h"

#include <bit>
#include <cstring>

namespace atlas {
namespace {

constexpr std::uint64_t kLowestBits = 0x1111'1111'1111'1111;  // of each nibble
constexpr std::uint64_t kLowNibbles = 0x0F0F'0F0F'0F0F'0F0F;
constexpr std::uint64_t kEachByte = 0x0101'0101'0101'0101;
constexpr std::size_t kWordBytes = sizeof(std::uint64_t);
constexpr int kMaxColumnNibbles = 16;
constexpr int kAltitudePlanes = 2;

// Up to eight bytes; those that are missing are 0.
std::uint64_t WordAt(ByteSpan bytes, std::size_t at) {
  std::uint64_t word = 0;
  if (at + kWordBytes <= bytes.size()) {
    std::memcpy(&word, bytes.data() + at, kWordBytes);  // one load
  } else {
    std::memcpy(&word, bytes.data() + at, bytes.size() - at);
  }
  return word;
}

// Bit 0 of each nibble: whether it is not 0.
std::uint64_t NonZeroNibbles(std::uint64_t word) {
  const std::uint64_t pairs = word | (word >> 1u);
  return (pairs | (pairs >> 2u)) & kLowestBits;
}

// Ones among the lowest bits of each nibble, of which alone `bits` has any.
std::size_t CountNibbles(std::uint64_t bits) {
  const std::uint64_t by_byte = (bits & kLowNibbles) + ((bits >> 4u) & kLowNibbles);
  return by_byte * kEachByte >> 56u;
}

bool HasCleanPadding(ByteSpan nibbles, std::size_t count) {
  return count % 2 == 0 || (nibbles.back() >> 4u) == 0;
}

// False: a cell that was not seen has an occupancy. A state is 2 bits source, 2 bits occupancy.
bool CountSeen(ByteSpan states, std::size_t& seen) {
  std::uint64_t wrong = 0;
  for (std::size_t at = 0; at < states.size(); at += kWordBytes) {
    const std::uint64_t word = WordAt(states, at);
    const std::uint64_t is_seen = (word | (word >> 1u)) & kLowestBits;
    const std::uint64_t has_occupancy = ((word >> 2u) | (word >> 3u)) & kLowestBits;
    wrong |= has_occupancy & ~is_seen;
    seen += CountNibbles(is_seen);
  }
  return wrong == 0;
}

// Ones among `count` bits, of which the bytes have no others. False: they have.
bool CountBits(ByteSpan bits, std::size_t count, std::size_t& ones) {
  for (std::size_t at = 0; at < bits.size(); at += kWordBytes) {
    ones += static_cast<std::size_t>(std::popcount(WordAt(bits, at)));
  }
  return count % 8 == 0 || (bits.back() >> (count % 8)) == 0;
}

// Planes of one nibble a column each: no column is empty, and the last plane is not.
bool AreColumns(ByteSpan planes, std::size_t count, std::size_t nibbles) {
  const std::size_t plane_bytes = (count + 1) / 2;
  for (std::size_t k = 0; k < nibbles; ++k) {
    if (!HasCleanPadding(planes.subspan(k * plane_bytes, plane_bytes), count)) {
      return false;
    }
  }
  std::size_t filled = 0;
  std::uint64_t last = 0;
  for (std::size_t at = 0; at < plane_bytes; at += kWordBytes) {
    std::uint64_t any = 0;
    for (std::size_t k = 0; k < nibbles; ++k) {
      const std::uint64_t word = WordAt(planes.subspan(k * plane_bytes, plane_bytes), at);
      any |= word;
      last |= k + 1 == nibbles ? word : 0;
    }
    filled += CountNibbles(NonZeroNibbles(any));
  }
  return filled == count && (last != 0) == (nibbles > 0);
}

}  // namespace

bool IsKeyframeBody(ByteSpan body, const GridGeometry& grid, std::size_t blocks) {
  ByteReader in(body);
  std::size_t seen = 0;
  const ByteSpan states = in.Raw((grid.size() + 1) / 2);
  if (!in.ok() || !HasCleanPadding(states, grid.size()) || !CountSeen(states, seen)) {
    return false;
  }
  in.Raw(kAltitudePlanes * seen);
  in.Raw(kAltitudePlanes * blocks);
  std::size_t columns = 0;
  const ByteSpan has_column = in.Raw((seen + 7) / 8);
  if (!in.ok() || !CountBits(has_column, seen, columns)) {
    return false;
  }
  const std::size_t nibbles = in.U8();
  if (!in.ok() || nibbles > kMaxColumnNibbles || in.remaining() != (columns + 1) / 2 * nibbles) {
    return false;
  }
  return AreColumns(in.Raw(in.remaining()), columns, nibbles);
}

}  // namespace atlas
