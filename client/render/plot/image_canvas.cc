#include <algorithm>
#include <cmath>

#include "client/render/lettering.h"
#include "client/render/plot/plot_canvas.h"

namespace atlas {
namespace {

constexpr Rgb kPaper{255, 255, 255};
constexpr std::int64_t kDot_px = 2;

std::int64_t TextPixels(std::string_view text) {
  return static_cast<std::int64_t>(text.size()) * Pen::kLetterWidth_dots * kDot_px;
}

}  // namespace

ImageCanvas::ImageCanvas(std::uint32_t width_px, std::uint32_t height_px)
    : image{width_px, height_px, std::vector<Rgb>(std::size_t{width_px} * height_px, kPaper)} {}

void ImageCanvas::Line(PlotPoint from, PlotPoint to, Rgb color, double width_px) {
  Pen pen(image, color);
  const auto width = std::max<std::int64_t>(1, std::llround(width_px));
  const double dx = to.x_px - from.x_px;
  const double dy = to.y_px - from.y_px;
  const auto steps =
      std::max<std::int64_t>(1, std::llround(std::ceil(std::max(std::abs(dx), std::abs(dy)))));
  for (std::int64_t i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(steps);
    pen.Fill(std::llround(from.x_px + share * dx) - width / 2,
             std::llround(from.y_px + share * dy) - width / 2, width, width);
  }
}

void ImageCanvas::Box(PlotPoint upper_left, PlotPoint lower_right, Rgb color) {
  const auto left = std::llround(upper_left.x_px);
  const auto top = std::llround(upper_left.y_px);
  Pen(image, color)
      .Fill(left, top, std::llround(lower_right.x_px) - left, std::llround(lower_right.y_px) - top);
}

void ImageCanvas::Text(PlotPoint at, std::string_view text, Rgb color, TextAnchor anchor) {
  const std::int64_t length_px = TextPixels(text);
  std::int64_t x = std::llround(at.x_px);
  if (anchor == TextAnchor::kMiddle) x -= length_px / 2;
  if (anchor == TextAnchor::kRight) x -= length_px;
  Pen(image, color)
      .Write(text, x, std::llround(at.y_px) - Pen::kLetterHeight_dots * kDot_px / 2, kDot_px);
}

void ImageCanvas::UprightText(PlotPoint at, std::string_view text, Rgb color) {
  Pen(image, color)
      .WriteUpwards(text, std::llround(at.x_px) - Pen::kLetterHeight_dots * kDot_px / 2,
                    std::llround(at.y_px) + TextPixels(text) / 2, kDot_px);
}

}  // namespace atlas
