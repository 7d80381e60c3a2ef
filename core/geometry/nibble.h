// The 4-bit occupancy probability of the paper (III-D), and the integer evidence it stands for.
//
// State 0 is "no data"; states 1..15 map linearly to [0.1, 0.9], 8 is exactly 0.5. (The paper maps
// them to [0, 1], where state 15 never decays and nothing dynamic can be removed.) Evidence is
// log-odds in units of ln(9)/64, so that [-64, 64] are the probabilities [0.1, 0.9].
#pragma once

#include <array>
#include <cstdint>

namespace atlas {

inline constexpr std::uint8_t kNibbleUnknown = 8;
inline constexpr std::uint8_t kNibbleHit = 12;  // one return in a segment: p = 0.73 (paper: 0.7)
inline constexpr std::uint8_t kNibbleMiss =
    6;  // rays passed and none returned: p = 0.39 (paper: 0.4)

inline constexpr std::uint8_t kNibbleFree = 1;  // the vehicle itself was there: p = 0.1
inline constexpr std::uint8_t kNibbleOver = 2;  // right above the vehicle: p = 0.16

inline constexpr int kEvidenceLimit = 64;

constexpr double NibbleProbability(std::uint8_t state) {
  return 0.1 + 0.8 * (state - 1) / 14.0;
}

// round(64 * logit(p) / ln 9) of states 1..15; index 0 is unused. Tested against the formula.
inline constexpr std::array<std::int8_t, 16> kNibbleEvidence = {
    0, -64, -49, -38, -29, -21, -14, -7, 0, 7, 14, 21, 29, 38, 49, 64};

// The state whose probability is nearest to that of `evidence`, clamped to +-64. Ties go to 8.
std::uint8_t NibbleFromEvidence(int evidence);

// p of evidence in the same units.
double EvidenceProbability(int evidence);

// Segment `i` (0 = lowest) of a column of up to 16 nibbles.
constexpr std::uint8_t NibbleAt(std::uint64_t column, int i) {
  return static_cast<std::uint8_t>((column >> (4 * i)) & 0xF);
}

}  // namespace atlas
