#include "client/render/plot/line_plot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "client/render/plot/plot_canvas.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr Rgb kInk{40, 44, 52};
constexpr Rgb kGrid{226, 229, 234};
constexpr Rgb kMark{120, 126, 136};
constexpr Rgb kFlag{214, 39, 40};

constexpr double kWidth_px = 900.0;
constexpr double kPanel_px = 200.0;  // from one panel's top to the next one's
constexpr double kGap_px = 30.0;     // of that, above a panel: its legend
constexpr double kLeft_px = 90.0;
constexpr double kRight_px = 20.0;
constexpr double kTop_px = 30.0;
constexpr double kFoot_px = 46.0;
constexpr double kFlag_px = 7.0;

constexpr double kStrip_px = 48.0;
constexpr double kBar_px = 18.0;      // of that, the bars themselves
constexpr double kThinnest_px = 2.0;  // a single scan of a long drive is seen

constexpr double kLetter_px = 8.0;

struct Span {
  double low = 0.0;
  double high = 1.0;
};

template <typename Use>
void ForEachPoint(const LinePlot& plot, const Use& use) {
  for (const PlotPanel& panel : plot.panels) {
    for (const PlotCurve& curve : panel.curves) {
      for (const Eigen::Vector2d& point : curve.points) {
        if (point.allFinite()) use(point);
      }
    }
  }
}

// Something to either side of what is in it.
Span Widened(double low, double high, double share) {
  if (!(low <= high)) return {};
  const double margin = high > low ? share * (high - low) : 0.5;
  return {low - margin, high + margin};
}

Span SpanOfX(const LinePlot& plot) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  const auto take = [&](double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  };
  ForEachPoint(plot, [&](const Eigen::Vector2d& point) { take(point.x()); });
  for (const double x : plot.marks) take(x);
  for (const double x : plot.flags) take(x);
  return Widened(low, high, 0.0);
}

Span SpanOfY(const PlotPanel& panel) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const PlotCurve& curve : panel.curves) {
    for (const Eigen::Vector2d& point : curve.points) {
      if (!point.allFinite()) continue;
      low = std::min(low, point.y());
      high = std::max(high, point.y());
    }
  }
  return Widened(low, high, 0.08);
}

// 1, 2 or 5 times a power of ten, so that about `count` steps fill the span.
double RoundStep(const Span& span, int count) {
  const double rough = (span.high - span.low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) return factor * power;
  }
  return 10.0 * power;
}

template <typename Use>
void ForEachTick(const Span& span, int count, const Use& use) {
  const double step = RoundStep(span, count);
  for (double i = std::ceil(span.low / step); i * step <= span.high; ++i) {
    use(i == 0.0 ? 0.0 : i * step);
  }
}

std::string TickText(double value) {
  return StrCat(std::round(value * 1e6) / 1e6);
}

class PanelArea {
 public:
  PanelArea(const Span& x, const Span& y, double top_px)
      : x_(x), y_(y), top_px_(top_px), bottom_px_(top_px + kPanel_px - kGap_px) {}

  double top_px() const { return top_px_; }
  double bottom_px() const { return bottom_px_; }
  PlotPoint At(const Eigen::Vector2d& point) const {
    return {X(point.x()),
            bottom_px_ - (point.y() - y_.low) / (y_.high - y_.low) * (bottom_px_ - top_px_)};
  }
  double X(double x) const {
    return kLeft_px + (x - x_.low) / (x_.high - x_.low) * (kWidth_px - kLeft_px - kRight_px);
  }
  const Span& x() const { return x_; }
  const Span& y() const { return y_; }

 private:
  Span x_;
  Span y_;
  double top_px_;
  double bottom_px_;
};

void DrawGrid(const PanelArea& area, bool has_numbers, PlotCanvas& canvas) {
  constexpr int kTicksAcross = 10;
  constexpr int kTicksUp = 5;
  ForEachTick(area.x(), kTicksAcross, [&](double x) {
    canvas.Line({area.X(x), area.top_px()}, {area.X(x), area.bottom_px()}, kGrid, 1.0);
    if (has_numbers) {
      canvas.Text({area.X(x), area.bottom_px() + 14.0}, TickText(x), kInk, TextAnchor::kMiddle);
    }
  });
  ForEachTick(area.y(), kTicksUp, [&](double y) {
    const PlotPoint left = area.At({area.x().low, y});
    canvas.Line(left, {kWidth_px - kRight_px, left.y_px}, y == 0.0 ? kMark : kGrid, 1.0);
    canvas.Text({kLeft_px - 8.0, left.y_px}, TickText(y), kInk, TextAnchor::kRight);
  });
}

void DrawCurve(const PanelArea& area, const PlotCurve& curve, PlotCanvas& canvas) {
  PlotPoint last;
  bool is_first = true;
  for (const Eigen::Vector2d& point : curve.points) {
    if (!point.allFinite()) {
      is_first = true;
      continue;
    }
    const PlotPoint at = area.At(point);
    canvas.Line(is_first ? at : last, at, curve.color, 2.0);
    last = at;
    is_first = false;
  }
}

void DrawPanel(const PanelArea& area,
               const LinePlot& plot,
               const PlotPanel& panel,
               PlotCanvas& canvas) {
  for (const double x : plot.marks) {
    canvas.Line({area.X(x), area.top_px()}, {area.X(x), area.bottom_px()}, kMark, 2.0);
  }
  for (const PlotCurve& curve : panel.curves) {
    DrawCurve(area, curve, canvas);
  }
  for (const double x : plot.flags) {
    canvas.Line({area.X(x), area.bottom_px()}, {area.X(x), area.bottom_px() - kFlag_px}, kFlag,
                2.0);
  }
  canvas.UprightText({14.0, 0.5 * (area.top_px() + area.bottom_px())}, panel.label, kInk);
  double x_px = kLeft_px;
  for (const PlotCurve& curve : panel.curves) {
    canvas.Line({x_px, area.top_px() - 9.0}, {x_px + 16.0, area.top_px() - 9.0}, curve.color, 3.0);
    canvas.Text({x_px + 22.0, area.top_px() - 9.0}, curve.name, kInk, TextAnchor::kLeft);
    x_px += 40.0 + kLetter_px * static_cast<double>(curve.name.size());
  }
}

// The better states first, so that the worse ones are seen.
void DrawStrip(const PlotStrip& strip, const Span& x, PlotCanvas& canvas) {
  const PanelArea area(x, {}, 0.0);
  const double top_px = kTop_px + kStrip_px - kBar_px;
  const double foot_px = kTop_px + kStrip_px;
  for (std::size_t state = 0; state < strip.states.size(); ++state) {
    const double share = static_cast<double>(state + 1) / static_cast<double>(strip.states.size());
    for (const PlotStrip::Part& part : strip.parts) {
      if (part.state != state || part.to < x.low || part.from > x.high) continue;
      const double left_px = area.X(std::max(part.from, x.low));
      const double right_px = std::max(area.X(std::min(part.to, x.high)), left_px + kThinnest_px);
      canvas.Box({left_px, foot_px - share * kBar_px}, {right_px, foot_px},
                 strip.states[state].color);
    }
  }
  canvas.Text({kLeft_px - 8.0, 0.5 * (top_px + foot_px)}, strip.name, kInk, TextAnchor::kRight);
  double legend_px = kLeft_px;
  for (const PlotStrip::State& state : strip.states) {
    canvas.Box({legend_px, top_px - 14.0}, {legend_px + 16.0, top_px - 4.0}, state.color);
    canvas.Text({legend_px + 22.0, top_px - 9.0}, state.name, kInk, TextAnchor::kLeft);
    legend_px += 40.0 + kLetter_px * static_cast<double>(state.name.size());
  }
}

double StripPixels(const LinePlot& plot) {
  return plot.strip.states.empty() ? 0.0 : kStrip_px;
}

void DrawNames(const LinePlot& plot, double height_px, PlotCanvas& canvas) {
  const double foot_px = height_px - 12.0;
  canvas.Text({kLeft_px, 10.0}, plot.title, kInk, TextAnchor::kLeft);
  canvas.Text({0.5 * (kLeft_px + kWidth_px - kRight_px), foot_px}, plot.x_label, kInk,
              TextAnchor::kMiddle);
  if (!plot.marks.empty()) {
    canvas.Text({kLeft_px, foot_px}, plot.mark_name, kMark, TextAnchor::kLeft);
  }
  if (!plot.flags.empty()) {
    canvas.Text({kWidth_px - kRight_px, foot_px}, plot.flag_name, kFlag, TextAnchor::kRight);
  }
}

double HeightPixels(const LinePlot& plot) {
  return kTop_px + StripPixels(plot) + kPanel_px * static_cast<double>(plot.panels.size()) +
         kFoot_px;
}

void Draw(const LinePlot& plot, PlotCanvas& canvas) {
  const Span x = SpanOfX(plot);
  if (!plot.strip.states.empty()) DrawStrip(plot.strip, x, canvas);
  for (std::size_t i = 0; i < plot.panels.size(); ++i) {
    const double top_px =
        kTop_px + StripPixels(plot) + kPanel_px * static_cast<double>(i) + kGap_px;
    const PanelArea area(x, SpanOfY(plot.panels[i]), top_px);
    DrawGrid(area, i + 1 == plot.panels.size(), canvas);
    DrawPanel(area, plot, plot.panels[i], canvas);
  }
  DrawNames(plot, HeightPixels(plot), canvas);
}

}  // namespace

Image DrawPlot(const LinePlot& plot) {
  ImageCanvas canvas(static_cast<std::uint32_t>(kWidth_px),
                     static_cast<std::uint32_t>(HeightPixels(plot)));
  Draw(plot, canvas);
  return std::move(canvas.image);
}

std::string PlotSvg(const LinePlot& plot) {
  SvgCanvas canvas(static_cast<std::uint32_t>(kWidth_px),
                   static_cast<std::uint32_t>(HeightPixels(plot)));
  Draw(plot, canvas);
  return canvas.svg();
}

}  // namespace atlas
