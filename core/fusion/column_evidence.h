// Columns of evidence: what the nibbles of several observations add up to (paper III-D). One value
// a segment, units of ln(9)/64, eight of them a register.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace atlas {

// A stretch's column reaches this many segments below and above what a column may hold, so that it
// need not move with its cell's altitude.
inline constexpr std::int32_t kColumnMargin = 4;
// Values of a stretch's column: whole registers.
constexpr std::size_t ColumnLanes(std::size_t column_segments) {
  return (column_segments + 2 * kColumnMargin + 7) / 8 * 8;
}

// Where a stretch's evidence saturates.
struct EvidenceClamp {
  std::int16_t usual;   // at +- this
  std::int16_t driven;  // kNibbleFree puts it at - this; nothing else goes deeper than -usual
};

// How evidence of stretches adds up (MapProfile's clamps of these names).
struct FoldClamp {
  std::int16_t stretch;
  std::int16_t carry;
  std::int16_t evidence;
};
// `sum` after a later stretch said `said`.
std::int16_t FoldEvidence(int sum, int said, const FoldClamp& clamp);

// Adds the evidence of a keyframe's nibbles, the lowest of them to value `offset`; what would come
// to lie outside is lost. `seen` gets a bit for each value that something was said about.
void AddNibbles(std::uint64_t nibbles,
                std::int64_t offset,
                const EvidenceClamp& clamp,
                std::span<std::int16_t> evidence,
                std::uint32_t& seen);

// The sum of stretches' evidence in one layer.
class ColumnSum {
 public:
  // FoldEvidence of each value, taken from value `offset` of a stretch's column on.
  void Fold(std::span<const std::int16_t> said,
            std::uint32_t said_seen,
            std::int64_t offset,
            const FoldClamp& clamp);
  // The nibbles of the segments in `mask`; 0 where nothing was said.
  std::uint64_t Nibbles(std::uint64_t mask) const;

 private:
  static constexpr std::size_t kSegments = 16;

  std::uint32_t seen_ = 0;
  std::array<std::int16_t, kSegments> evidence_{};
};

}  // namespace atlas
