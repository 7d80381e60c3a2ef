#include "core/column/polar_misses.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/base/vector_clones.h"

namespace atlas {
namespace {

// In whole chunks, the last of them over the one before: lengths differ from run to run, and loops
// that end at any of them cost more than marking twice.
inline void Mark(HalfMask* begin, HalfMask* end, HalfMask bit) {
  constexpr std::ptrdiff_t kChunk = 8;
  if (end - begin < kChunk) {
    for (; begin < end; ++begin) {
      *begin |= bit;
    }
    return;
  }
  for (HalfMask* chunk = begin; chunk < end; chunk += kChunk) {
    HalfMask* masks = std::min(chunk, end - kChunk);
    for (std::ptrdiff_t k = 0; k < kChunk; ++k) {
      masks[k] |= bit;
    }
  }
}

}  // namespace

// The ray rises (or falls) through one half segment after the other.
ATLAS_VECTOR_CLONES
void PolarMisses::Fill(HalfMask* masks, int end, float slope) const {
  const float halves_per_step = std::abs(slope) * rays_.step_m() / halves_.half_height_m();
  const float steps_per_half = halves_per_step > 1e-6F ? 1.0F / halves_per_step : 1e9F;
  const int direction = slope < 0.0F ? -1 : 1;
  int half = slope < 0.0F ? -1 : 0;  // the sensor is on the border between these two
  float border = steps_per_half;     // in steps from the sensor
  for (int begin = 0; begin < end; half += direction) {
    if (halves_.IsPast(half, direction)) {
      return;
    }
    const HalfMask bit = halves_.Bit(half);
    const int stop = border < static_cast<float>(end) ? static_cast<int>(border) : end;
    Mark(masks + begin, masks + stop, bit);
    begin = stop;
    border += steps_per_half;
  }
}

}  // namespace atlas
