// Random numbers as a pure function of what they are for: no state to share, no order to keep, and
// no libm, so that every machine draws the same.
#pragma once

#include <cstdint>

namespace atlas {

// A stream named by up to three numbers (seed, scan, ray); streams of different names are
// independent.
class HashRandom {
 public:
  explicit HashRandom(std::uint64_t a, std::uint64_t b = 0, std::uint64_t c = 0)
      : state_(Mix(Mix(Mix(a) ^ b) ^ c)) {}

  // SplitMix64 (Steele, Lea, Flood 2014).
  std::uint64_t Next() {
    state_ += 0x9E3779B97F4A7C15u;
    return Mix(state_);
  }

  double Uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(Next() >> 11) * 0x1p-53;
  }

  // Requires count > 0.
  std::uint32_t Below(std::uint32_t count) { return static_cast<std::uint32_t>(Next() % count); }

  // Mean 0, variance 1: the sum of twelve uniforms of 16 bits, hence within +-6.
  double Gaussian() {
    std::uint32_t sum = 0;
    for (int word = 0; word < 3; ++word) {
      const std::uint64_t bits = Next();
      sum += static_cast<std::uint32_t>((bits & 0xFFFF) + ((bits >> 16) & 0xFFFF) +
                                        ((bits >> 32) & 0xFFFF) + (bits >> 48));
    }
    return static_cast<double>(sum) / 65535.0 - 6.0;
  }

 private:
  static std::uint64_t Mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
};

}  // namespace atlas
