// atan2 to 1e-5 rad without a library call, for binning hundreds of thousands of azimuths.
#pragma once

#include <cmath>
#include <numbers>

namespace atlas {

// Minimax polynomial of atan on [0, 1] (Abramowitz and Stegun 4.4.49: |error| <= 1e-5).
inline float FastAtan2(float y, float x) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float larger = ax > ay ? ax : ay;
  const float smaller = ax > ay ? ay : ax;
  const float t = smaller / (larger > 0.0F ? larger : 1.0F);  // no branch: loops of it are vectors
  const float s = t * t;
  float angle =
      t * (0.9998660F + s * (-0.3302995F + s * (0.1801410F + s * (-0.0851330F + s * 0.0208351F))));
  angle = ay > ax ? 0.5F * std::numbers::pi_v<float> - angle : angle;
  angle = x < 0.0F ? std::numbers::pi_v<float> - angle : angle;
  return y < 0.0F ? -angle : angle;
}

}  // namespace atlas
