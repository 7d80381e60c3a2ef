// A column of evidence: what the nibbles of several observations add up to (paper III-D).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace atlas {

struct ColumnEvidence {
  static constexpr std::size_t kSegments = 16;

  std::uint64_t seen = 0;  // a segment's nibble is not 0 once anything was said about it
  alignas(16) std::array<std::int16_t, kSegments> evidence{};  // units of ln(9)/64

  // Where a session's evidence saturates.
  struct Clamp {
    std::int16_t usual;   // at +- this
    std::int16_t driven;  // kNibbleFree puts it at - this; nothing else goes deeper than -usual
  };

  // Adds the evidence of a keyframe's nibbles.
  void AddNibbles(std::uint64_t nibbles, const Clamp& clamp);
  // Adds another column's evidence, of which at most +-`say` counts; each sum saturates at +-clamp.
  void Add(const ColumnEvidence& other, std::int16_t say, std::int16_t clamp);
};

// The nibbles of evidence; 0 where nothing was said.
std::uint64_t NibblesOfEvidence(const ColumnEvidence& column);

}  // namespace atlas
