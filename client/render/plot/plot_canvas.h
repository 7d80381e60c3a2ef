// What a plot is drawn on. Pixels from the upper left corner; colours are the caller's.
#pragma once

#include <string>
#include <string_view>

#include "client/render/image.h"

namespace atlas {

enum class TextAnchor { kLeft, kMiddle, kRight };

struct PlotPoint {
  double x_px = 0.0;
  double y_px = 0.0;
};

class PlotCanvas {
 public:
  PlotCanvas() = default;
  PlotCanvas(const PlotCanvas&) = delete;
  PlotCanvas& operator=(const PlotCanvas&) = delete;
  virtual ~PlotCanvas() = default;

  virtual void Line(PlotPoint from, PlotPoint to, Rgb color, double width_px) = 0;
  // Filled.
  virtual void Box(PlotPoint upper_left, PlotPoint lower_right, Rgb color) = 0;
  // `at` is where the text's middle line begins, is halfway or ends.
  virtual void Text(PlotPoint at, std::string_view text, Rgb color, TextAnchor anchor) = 0;
  // Its middle is at `at`; read from below.
  virtual void UprightText(PlotPoint at, std::string_view text, Rgb color) = 0;
};

class ImageCanvas : public PlotCanvas {
 public:
  ImageCanvas(std::uint32_t width_px, std::uint32_t height_px);

  void Line(PlotPoint from, PlotPoint to, Rgb color, double width_px) override;
  void Box(PlotPoint upper_left, PlotPoint lower_right, Rgb color) override;
  void Text(PlotPoint at, std::string_view text, Rgb color, TextAnchor anchor) override;
  void UprightText(PlotPoint at, std::string_view text, Rgb color) override;

  Image image;
};

class SvgCanvas : public PlotCanvas {
 public:
  SvgCanvas(std::uint32_t width_px, std::uint32_t height_px);

  void Line(PlotPoint from, PlotPoint to, Rgb color, double width_px) override;
  void Box(PlotPoint upper_left, PlotPoint lower_right, Rgb color) override;
  void Text(PlotPoint at, std::string_view text, Rgb color, TextAnchor anchor) override;
  void UprightText(PlotPoint at, std::string_view text, Rgb color) override;

  // The whole document.
  std::string svg() const { return svg_ + "</svg>\n"; }

 private:
  std::string svg_;
};

}  // namespace atlas
