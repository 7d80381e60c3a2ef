// Columns of evidence: what the nibbles of several observations add up to (paper III-D). One value
// a segment, units of ln(9)/64, sixteen of them a register.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace atlas {

// A stretch's column reaches a few segments below and above what a column may hold, so that it need
// not move with its cell's altitude.
using ColumnLanes = std::array<std::int8_t, 16>;
constexpr std::int32_t ColumnMargin(std::int32_t column_segments) {
  return std::clamp((16 - column_segments) / 2, 1, 4);
}

// Where a stretch's evidence saturates; at most 127.
struct EvidenceClamp {
  std::int8_t usual;  // at +- this
  // kNibbleFree puts it at - this, until released if that is deeper than -usual; kNibbleOver one
  // short of it, and hits add up from there.
  std::int8_t driven;
};

// Adds the evidence of a keyframe's nibbles, the lowest of them to value `offset`; what would come
// to lie outside is lost. `seen` gets a bit for each value that something was said about.
void AddNibbles(std::uint64_t nibbles,
                std::int64_t offset,
                const EvidenceClamp& clamp,
                ColumnLanes& evidence,
                std::uint16_t& seen);

// Whether a keyframe says of some segment that its vehicle is there itself, or right below it.
bool SpeakOfVehicle(std::uint64_t nibbles);
// Brings evidence that is deeper than usual back to where hits add up from.
void ReleaseDriven(const EvidenceClamp& clamp, ColumnLanes& evidence);

// Whether one of them is `value`.
bool HasValue(const ColumnLanes& evidence, std::int8_t value);
// Of `evidence`, whose first value stands beside value `offset` of `other`: what is above 0 becomes
// 0 where the other is `value`.
void DropHitsWhere(const ColumnLanes& other,
                   std::int8_t value,
                   std::int64_t offset,
                   ColumnLanes& evidence);

// How evidence of stretches adds up (MapProfile's clamps of these names).
struct FoldClamp {
  std::int8_t stretch;
  std::int8_t carry;
  std::int8_t evidence;
};
// `sum` after a later stretch said `said`.
int FoldEvidence(int sum, int said, const FoldClamp& clamp);

// The sum of stretches' evidence in one layer.
class ColumnSum {
 public:
  // FoldEvidence of each value, taken from value `offset` of a stretch's column on.
  void Fold(const ColumnLanes& said,
            std::uint16_t said_seen,
            std::int64_t offset,
            const FoldClamp& clamp);
  // What stood on a place that is free now is gone, too: evidence above 0 `before` this stretch
  // spoke, without a gap from the lowest value or the next one upwards, is not above 0 any more;
  // but not where the stretch, whose column is taken from value `offset` on, says that some of it
  // is there. `values`: that are published.
  void DropWhatStood(const ColumnSum& before,
                     const ColumnLanes& said,
                     std::int64_t offset,
                     std::size_t values);
  // The nibbles of the segments in `mask`; 0 where nothing was said.
  std::uint64_t Nibbles(std::uint64_t mask) const;

 private:
  std::uint32_t seen_ = 0;
  ColumnLanes evidence_{};
};

}  // namespace atlas
