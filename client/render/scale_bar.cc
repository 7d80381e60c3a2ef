#include "client/render/scale_bar.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "client/render/lettering.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr Rgb kInk{214, 219, 226};
constexpr std::int64_t kDot_px = 2;  // a dot of a letter
constexpr std::int64_t kBarThickness_px = 2;
constexpr std::int64_t kTick_px = 8;
constexpr std::int64_t kMaxBar_px = 200;
constexpr std::int64_t kMinBar_px = 20;

std::string LengthText(double metres) {
  return metres >= 1000.0 ? StrCat(metres / 1000.0, " km") : StrCat(metres, " m");
}

}  // namespace

double RoundBarLength(double metres_per_pixel, double max_px) {
  const double max_m = metres_per_pixel * max_px;
  double longest_m = 0.0;
  for (int power = -3; power <= 7; ++power) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double length_m = factor * std::pow(10.0, power);
      if (length_m <= max_m) longest_m = length_m;
    }
  }
  return longest_m;
}

void DrawScaleBar(double metres_per_pixel, std::int64_t margin_px, Image& image) {
  const std::int64_t room_px = std::min<std::int64_t>(image.width / 2, kMaxBar_px);
  const double length_m = RoundBarLength(metres_per_pixel, static_cast<double>(room_px));
  const std::int64_t bar_px = std::llround(length_m / metres_per_pixel);
  if (bar_px < kMinBar_px || image.height < kScaleBarHeight_px) return;
  const std::int64_t bottom = std::int64_t{image.height} - margin_px / 2;
  Pen pen(image, kInk);
  pen.Fill(margin_px, bottom - kBarThickness_px, bar_px, kBarThickness_px);
  pen.Fill(margin_px, bottom - kTick_px, kBarThickness_px, kTick_px);
  pen.Fill(margin_px + bar_px - kBarThickness_px, bottom - kTick_px, kBarThickness_px, kTick_px);
  pen.Write(LengthText(length_m), margin_px + bar_px + 3 * kDot_px, bottom - 5 * kDot_px, kDot_px);
}

}  // namespace atlas
