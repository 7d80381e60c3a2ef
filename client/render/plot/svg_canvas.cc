#include <array>
#include <cmath>

#include "client/render/plot/plot_canvas.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

std::string Hex(Rgb color) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text = "#";
  for (const std::uint8_t channel : {color.red, color.green, color.blue}) {
    text += kDigits[channel >> 4];
    text += kDigits[channel & 15];
  }
  return text;
}

double Tenth(double px) {
  return std::round(px * 10.0) / 10.0;
}

std::string Escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '&') {
      escaped += "&amp;";
    } else if (c == '<') {
      escaped += "&lt;";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string_view AnchorName(TextAnchor anchor) {
  switch (anchor) {
    case TextAnchor::kLeft:
      return "start";
    case TextAnchor::kMiddle:
      return "middle";
    case TextAnchor::kRight:
      return "end";
  }
  return "start";
}

}  // namespace

SvgCanvas::SvgCanvas(std::uint32_t width_px, std::uint32_t height_px)
    : svg_(StrCat("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"",
                  width_px,
                  "\" height=\"",
                  height_px,
                  "\" font-family=\"sans-serif\" font-size=\"12\">\n",
                  "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n")) {}

void SvgCanvas::Line(PlotPoint from, PlotPoint to, Rgb color, double width_px) {
  svg_ += StrCat("<line x1=\"", Tenth(from.x_px), "\" y1=\"", Tenth(from.y_px), "\" x2=\"",
                 Tenth(to.x_px), "\" y2=\"", Tenth(to.y_px), "\" stroke=\"", Hex(color),
                 "\" stroke-width=\"", width_px, "\" stroke-linecap=\"round\"/>\n");
}

void SvgCanvas::Box(PlotPoint upper_left, PlotPoint lower_right, Rgb color) {
  svg_ += StrCat("<rect x=\"", Tenth(upper_left.x_px), "\" y=\"", Tenth(upper_left.y_px),
                 "\" width=\"", Tenth(lower_right.x_px - upper_left.x_px), "\" height=\"",
                 Tenth(lower_right.y_px - upper_left.y_px), "\" fill=\"", Hex(color), "\"/>\n");
}

void SvgCanvas::Text(PlotPoint at, std::string_view text, Rgb color, TextAnchor anchor) {
  svg_ += StrCat("<text x=\"", Tenth(at.x_px), "\" y=\"", Tenth(at.y_px + 4.0), "\" fill=\"",
                 Hex(color), "\" text-anchor=\"", AnchorName(anchor), "\">", Escaped(text),
                 "</text>\n");
}

void SvgCanvas::UprightText(PlotPoint at, std::string_view text, Rgb color) {
  svg_ += StrCat("<text transform=\"translate(", Tenth(at.x_px + 4.0), " ", Tenth(at.y_px),
                 ") rotate(-90)\" fill=\"", Hex(color), "\" text-anchor=\"middle\">", Escaped(text),
                 "</text>\n");
}

}  // namespace atlas
