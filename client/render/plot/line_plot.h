// Curves over one axis, in panels below each other: as a picture or as SVG text.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "client/render/image.h"

namespace atlas {

struct PlotCurve {
  std::string name;
  Rgb color;
  std::vector<Eigen::Vector2d> points;  // a coordinate that is not finite interrupts it
};

struct PlotPanel {
  std::string label;  // of the upright axis
  std::vector<PlotCurve> curves;
};

struct LinePlot {
  std::string title;
  std::string x_label;
  std::vector<PlotPanel> panels;
  // Upright lines through all panels, and ticks at the foot of each, at these x.
  std::vector<double> marks;
  std::vector<double> flags;
  std::string mark_name = "restart";
  std::string flag_name = "failed";
};

// 900 pixels wide, 200 high a panel. Without a point there are empty panels.
Image DrawPlot(const LinePlot& plot);
std::string PlotSvg(const LinePlot& plot);

}  // namespace atlas
