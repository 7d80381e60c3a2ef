// How far apart two Gaussians of equal weight may lie and still have OLR > 0.6 (paper eq. 1).
// Derived by numerical search for the mixture's saddle and peaks; the test derives it again.
#pragma once

#include <array>
#include <cstdint>

namespace atlas {

inline constexpr int kOverlapOctaves = 6;   // sigma_max / sigma_min from 1 to 64
inline constexpr int kOverlapStepBits = 4;  // 16 equal steps an octave
inline constexpr int kOverlapBits = 12;

// Entry 16 k + j: the largest |difference of means| / sigma_min with OLR > 0.6 at the ratio
// 2^k (1 + j / 16), x 2^12.
// clang-format off
inline constexpr std::array<std::int32_t, (kOverlapOctaves << kOverlapStepBits) + 1> kOverlapLimit = {
    12666, 13227, 13757, 14261, 14745, 15211, 15661, 16099, 16525, 16940, 17347, 17745,
    18136, 18521, 18900, 19273, 19641, 20363, 21070, 21763, 22444, 23115, 23776, 24429,
    25075, 25713, 26346, 26973, 27595, 28213, 28826, 29435, 30041, 31242, 32432, 33612,
    34782, 35944, 37099, 38248, 39391, 40528, 41661, 42789, 43914, 45034, 46151, 47265,
    48376, 50590, 52794, 54990, 57178, 59359, 61535, 63705, 65870, 68030, 70187, 72340,
    74489, 76635, 78778, 80919, 83056, 87325, 91585, 95838, 100085, 104325, 108560, 112791,
    117017, 121239, 125458, 129673, 133885, 138094, 142301, 146505, 150707, 159105, 167495, 175879,
    184257, 192629, 200997, 209360, 217719, 226075, 234428, 242777, 251124, 259468, 267810, 276150,
    284487};
// clang-format on

}  // namespace atlas
