// A column of evidence: what the nibbles of several observations add up to (paper III-D).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/geometry/nibble.h"

namespace atlas {

struct ColumnEvidence {
  static constexpr std::size_t kSegments = 16;

  std::uint64_t seen = 0;  // a segment's nibble is not 0 once anything was said about it
  alignas(16) std::array<std::int16_t, kSegments> evidence{};  // units of ln(9)/64

  // Adds `other`, each sum saturating at +-clamp.
  void Add(const ColumnEvidence& other, std::int16_t clamp) {
    seen |= other.seen;
    for (std::size_t k = 0; k < kSegments; ++k) {
      const auto sum = static_cast<std::int16_t>(evidence[k] + other.evidence[k]);
      const auto low = static_cast<std::int16_t>(-clamp);
      evidence[k] = std::min(std::max(sum, low), clamp);
    }
  }
};

// The evidence of a keyframe's nibbles.
ColumnEvidence EvidenceOfNibbles(std::uint64_t nibbles);

// The nibbles of evidence; 0 where nothing was said.
std::uint64_t NibblesOfEvidence(const ColumnEvidence& column);

}  // namespace atlas
