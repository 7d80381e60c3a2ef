#include "client/render/scale_bar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr Rgb kInk{214, 219, 226};
constexpr std::int64_t kDot_px = 2;  // a dot of a letter
constexpr std::int64_t kBarThickness_px = 2;
constexpr std::int64_t kTick_px = 8;
constexpr std::int64_t kMaxBar_px = 200;
constexpr std::int64_t kMinBar_px = 20;

// Letters of 3 x 5 dots, a row in three bits, the upper row first.
struct Letter {
  char name;
  std::array<std::uint8_t, 5> rows;
};
constexpr std::array<Letter, 13> kLetters = {{{'0', {7, 5, 5, 5, 7}},
                                              {'1', {2, 6, 2, 2, 7}},
                                              {'2', {7, 1, 7, 4, 7}},
                                              {'3', {7, 1, 7, 1, 7}},
                                              {'4', {5, 5, 7, 1, 1}},
                                              {'5', {7, 4, 7, 1, 7}},
                                              {'6', {7, 4, 7, 5, 7}},
                                              {'7', {7, 1, 2, 2, 2}},
                                              {'8', {7, 5, 7, 5, 7}},
                                              {'9', {7, 5, 7, 1, 7}},
                                              {'.', {0, 0, 0, 0, 2}},
                                              {'m', {0, 7, 7, 5, 5}},
                                              {'k', {4, 5, 6, 5, 5}}}};

class Pen {
 public:
  explicit Pen(Image& image) : image_(image) {}

  void Fill(std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height) {
    for (std::int64_t row = y; row < y + height; ++row) {
      for (std::int64_t column = x; column < x + width; ++column) {
        if (row < 0 || column < 0 || row >= image_.height || column >= image_.width) continue;
        image_.at(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row)) = kInk;
      }
    }
  }

  void Write(const std::string& text, std::int64_t x, std::int64_t y) {
    for (const char name : text) {
      const auto letter =
          std::find_if(kLetters.begin(), kLetters.end(),
                       [name](const Letter& candidate) { return candidate.name == name; });
      if (letter != kLetters.end()) Write(*letter, x, y);
      x += 4 * kDot_px;
    }
  }

 private:
  void Write(const Letter& letter, std::int64_t x, std::int64_t y) {
    for (std::size_t row = 0; row < letter.rows.size(); ++row) {
      for (std::int64_t column = 0; column < 3; ++column) {
        if (((letter.rows[row] >> (2 - column)) & 1) == 0) continue;
        Fill(x + column * kDot_px, y + static_cast<std::int64_t>(row) * kDot_px, kDot_px, kDot_px);
      }
    }
  }

  Image& image_;
};

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
  Pen pen(image);
  pen.Fill(margin_px, bottom - kBarThickness_px, bar_px, kBarThickness_px);
  pen.Fill(margin_px, bottom - kTick_px, kBarThickness_px, kTick_px);
  pen.Fill(margin_px + bar_px - kBarThickness_px, bottom - kTick_px, kBarThickness_px, kTick_px);
  pen.Write(LengthText(length_m), margin_px + bar_px + 3 * kDot_px, bottom - 5 * kDot_px);
}

}  // namespace atlas
