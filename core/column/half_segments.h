// Column segments in halves, as bits of one word.
#pragma once

#include <cmath>
#include <cstdint>

namespace atlas {

// Bit 2k is the lower half of segment `first_segment + k`, bit 2k + 1 the upper one.
using HalfMask = std::uint64_t;
inline constexpr HalfMask kLowerHalves = 0x5555'5555'5555'5555;

// Which heights of the levelled frame the bits of a HalfMask are.
class HalfSegments {
 public:
  // From eight segments below the ground under the sensor to 24 above it.
  HalfSegments(float segment_height_m, float ground_m)
      : segment_height_m_(segment_height_m),
        segments_per_m_(1.0F / segment_height_m),
        first_segment_(static_cast<int>(std::floor(ground_m / segment_height_m)) - kBelowGround) {}

  float half_height_m() const { return 0.5F * segment_height_m_; }

  // The bit of the half that begins `halves` half segments above the sensor; 0: out of reach.
  HalfMask Bit(int halves) const {
    const int bit = halves - 2 * first_segment_;
    return bit >= 0 && bit < kBits ? HalfMask{1} << bit : 0;
  }
  // Whether a ray that rises (direction 1) or falls (-1) from there comes into no half in reach.
  bool IsPast(int halves, int direction) const {
    const int bit = halves - 2 * first_segment_;
    return direction > 0 ? bit >= kBits : bit < 0;
  }
  // Both bits of the segment at a height.
  HalfMask SegmentAt(float z_m) const {
    const int bit = FirstBit(z_m);
    return bit >= 0 && bit < kBits ? HalfMask{3} << bit : 0;
  }
  // All segments below the one at a height.
  HalfMask Below(float z_m) const {
    const int bit = FirstBit(z_m);
    return bit <= 0 ? 0 : bit >= kBits ? ~HalfMask{0} : (HalfMask{1} << bit) - 1;
  }

  // The halves from segment `anchor` on, its lower one in bit 0.
  HalfMask From(int anchor, HalfMask mask) const {
    const int shift = 2 * (anchor - first_segment_);
    if (shift <= -kBits || shift >= kBits) {
      return 0;
    }
    return shift >= 0 ? mask >> shift : mask << -shift;
  }

 private:
  // Of the segment at a height.
  int FirstBit(float z_m) const {
    return 2 * (static_cast<int>(std::floor(z_m * segments_per_m_)) - first_segment_);
  }

  static constexpr int kBits = 64;
  static constexpr int kBelowGround = 8;

  float segment_height_m_;
  float segments_per_m_;
  int first_segment_;
};

}  // namespace atlas
