#include "client/render/color_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace atlas {
namespace {

// Every eighth of matplotlib's viridis and inferno (CC0); between them a straight line is closer
// than a screen shows.
constexpr std::array<Rgb, 9> kViridis = {{{68, 1, 84},
                                          {71, 45, 123},
                                          {59, 82, 139},
                                          {44, 114, 142},
                                          {33, 145, 140},
                                          {40, 174, 128},
                                          {94, 201, 98},
                                          {173, 220, 48},
                                          {253, 231, 37}}};
constexpr std::array<Rgb, 9> kInferno = {{{0, 0, 4},
                                          {31, 12, 72},
                                          {85, 15, 109},
                                          {136, 34, 106},
                                          {186, 54, 85},
                                          {227, 89, 51},
                                          {249, 140, 10},
                                          {249, 201, 50},
                                          {252, 255, 164}}};
// Okabe and Ito's colours, which most colour-blind people tell apart.
constexpr std::array<Rgb, 6> kCounts = {
    {{86, 180, 233}, {230, 159, 0}, {0, 158, 115}, {240, 228, 66}, {204, 121, 167}, {213, 94, 0}}};

std::uint8_t Channel(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

Rgb Interpolate(std::span<const Rgb> stops, double t) {
  const double position = std::clamp(t, 0.0, 1.0) * static_cast<double>(stops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(position), stops.size() - 2);
  return Mix(stops[below], stops[below + 1], position - static_cast<double>(below));
}

}  // namespace

Rgb HeightColor(double t) {
  return Interpolate(kViridis, t);
}

Rgb ColumnColor(double t) {
  return Interpolate(kInferno, t);
}

Rgb CountColor(int count) {
  const int last = static_cast<int>(kCounts.size()) - 1;
  return kCounts[static_cast<std::size_t>(std::clamp(count - 1, 0, last))];
}

Rgb Mix(const Rgb& a, const Rgb& b, double b_share) {
  const auto mix = [b_share](std::uint8_t x, std::uint8_t y) {
    return Channel(x + b_share * (y - x));
  };
  return {mix(a.red, b.red), mix(a.green, b.green), mix(a.blue, b.blue)};
}

Rgb Shade(const Rgb& color, double factor) {
  return {Channel(color.red * factor), Channel(color.green * factor), Channel(color.blue * factor)};
}

}  // namespace atlas
