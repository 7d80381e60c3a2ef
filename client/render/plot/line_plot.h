// Curves over one axis, in panels below each other: as a picture or as SVG text.
#pragma once

#include <cstddef>
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

// In which of some states what is plotted was, along the axis: bars, the higher the worse.
struct PlotStrip {
  struct State {
    std::string name;
    Rgb color;
  };
  struct Part {
    double from = 0.0;
    double to = 0.0;
    std::size_t state = 0;
  };

  std::string name;
  std::vector<State> states;  // the best first
  std::vector<Part> parts;    // where some overlap the worst is seen
};

struct LinePlot {
  std::string title;
  std::string x_label;
  std::vector<PlotPanel> panels;
  PlotStrip strip;  // above the panels; none where it has no states
  // Upright lines through all panels, and ticks at the foot of each, at these x.
  std::vector<double> marks;
  std::vector<double> flags;
  std::string mark_name = "restart";
  std::string flag_name = "failed";
};

// 900 pixels wide, 200 high a panel, 48 a strip. Without a point there are empty panels.
Image DrawPlot(const LinePlot& plot);
std::string PlotSvg(const LinePlot& plot);

}  // namespace atlas
