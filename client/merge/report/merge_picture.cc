#include "client/merge/report/merge_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "client/render/plot/plot_canvas.h"

namespace atlas {
namespace {

constexpr double kPanel_px = 700.0;
constexpr double kMargin_px = 30.0;
constexpr double kHead_px = 40.0;
constexpr double kLine_px = 18.0;  // of the legend

constexpr Rgb kInk{40, 40, 40};
constexpr Rgb kClosure{170, 170, 170};
constexpr Rgb kTile{222, 235, 247};
constexpr std::size_t kLongClosures = 60;
// Told apart by those who see no red or green, too (Okabe and Ito).
constexpr std::array<Rgb, 7> kColors{{{0, 114, 178},
                                      {213, 94, 0},
                                      {0, 158, 115},
                                      {204, 121, 167},
                                      {86, 180, 233},
                                      {230, 159, 0},
                                      {0, 0, 0}}};

// Pixels that are drawn, and that are not, over and over.
struct Dash {
  double on_px;
  double off_px;
};
// One for each round through the colours.
constexpr std::array<Dash, 3> kDashes{{{1.0, 0.0}, {14.0, 7.0}, {4.0, 5.0}}};

struct Look {
  Rgb color;
  Dash dash;
};

Look LookOf(std::size_t session) {
  return {kColors[session % kColors.size()], kDashes[session / kColors.size() % kDashes.size()]};
}

Eigen::AlignedBox2d BoundsOf(const MergePicture& picture) {
  Eigen::AlignedBox2d bounds;
  for (const PictureSession& session : picture.sessions) {
    for (const Eigen::Vector2d& p : session.before) bounds.extend(p);
    for (const Eigen::Vector2d& p : session.after) bounds.extend(p);
  }
  if (bounds.isEmpty()) return bounds;
  for (const Eigen::AlignedBox2d& tile : picture.tiles) bounds.extend(tile);
  return bounds;
}

// Whether a line is drawn so far from its beginning.
bool IsOn(const Dash& dash, double way_px) {
  return std::fmod(way_px, dash.on_px + dash.off_px) < dash.on_px;
}

// A line that goes on where one of `way_px` ended; how long both are.
double DrawDashed(PlotCanvas& canvas,
                  PlotPoint from,
                  PlotPoint to,
                  const Look& look,
                  double width_px,
                  double way_px) {
  const double dx = to.x_px - from.x_px;
  const double dy = to.y_px - from.y_px;
  const double length_px = std::hypot(dx, dy);
  if (look.dash.off_px == 0.0) {
    canvas.Line(from, to, look.color, width_px);
    return way_px + length_px;
  }
  const auto steps = static_cast<int>(std::ceil(std::max(1.0, length_px)));
  const auto at = [&](int step) {
    const double share = static_cast<double>(step) / steps;
    return PlotPoint{from.x_px + share * dx, from.y_px + share * dy};
  };
  for (int i = 0; i < steps; ++i) {
    if (IsOn(look.dash, way_px + length_px * i / steps)) {
      canvas.Line(at(i), at(i + 1), look.color, width_px);
    }
  }
  return way_px + length_px;
}

// From the world to a panel whose left edge is at `left_px`; north is up.
class Panel {
 public:
  Panel(const Eigen::AlignedBox2d& bounds, double left_px, PlotCanvas& canvas)
      : canvas_(canvas),
        center_(bounds.center()),
        middle_{left_px + 0.5 * kPanel_px, kHead_px + 0.5 * kPanel_px},
        px_a_m_((kPanel_px - 2.0 * kMargin_px) / std::max(1.0, bounds.sizes().maxCoeff())) {}

  void Way(const std::vector<Eigen::Vector2d>& points, const Look& look) {
    constexpr double kJump_m = 10.0;  // nobody drove it
    double way_px = 0.0;
    for (std::size_t i = 1; i < points.size(); ++i) {
      if ((points[i] - points[i - 1]).norm() > kJump_m) continue;
      way_px = DrawDashed(canvas_, At(points[i - 1]), At(points[i]), look, 2.0, way_px);
    }
  }

  // With a pixel to the next one, where they are large enough.
  void Tile(const Eigen::AlignedBox2d& tile) {
    const PlotPoint low = At(tile.min());
    const PlotPoint high = At(tile.max());
    const double gap_px = high.x_px - low.x_px > 4.0 ? 1.0 : 0.0;
    for (double y_px = std::ceil(high.y_px); y_px <= low.y_px - gap_px; y_px += 1.0) {
      canvas_.Line({low.x_px, y_px}, {high.x_px - 2.0 * gap_px, y_px}, kTile, 1.0);
    }
  }

  // Short ones all; of long ones so many, spread over them.
  void Closures(const std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>& closures) {
    const double long_m = 0.1 * kPanel_px / px_a_m_;
    const auto is_long = [&](const auto& closure) {
      return (closure.second - closure.first).norm() > long_m;
    };
    const auto all =
        static_cast<std::size_t>(std::count_if(closures.begin(), closures.end(), is_long));
    const std::size_t drawn = std::min(all, kLongClosures);
    std::size_t number = 0;
    for (const auto& closure : closures) {
      if (is_long(closure)) {
        // One of so many each, the last of them.
        const bool is_drawn = (number + 1) * drawn / all > number * drawn / all;
        ++number;
        if (!is_drawn) continue;
      }
      canvas_.Line(At(closure.first), At(closure.second), kClosure, 1.0);
    }
  }

  // A round length below a quarter of the panel.
  void Scale() {
    const double most_m = 0.25 * kPanel_px / px_a_m_;
    const double ten = std::pow(10.0, std::floor(std::log10(most_m)));
    const double length_m = most_m >= 5.0 * ten ? 5.0 * ten : most_m >= 2.0 * ten ? 2.0 * ten : ten;
    const double y_px = kHead_px + kPanel_px - 12.0;
    const double x_px = middle_.x_px - 0.5 * kPanel_px + kMargin_px;
    canvas_.Line({x_px, y_px}, {x_px + length_m * px_a_m_, y_px}, kInk, 2.0);
    canvas_.Text({x_px + length_m * px_a_m_ + 8.0, y_px},
                 std::to_string(std::lround(length_m)) + " m", kInk, TextAnchor::kLeft);
  }

 private:
  PlotPoint At(const Eigen::Vector2d& p) const {
    return {middle_.x_px + px_a_m_ * (p.x() - center_.x()),
            middle_.y_px - px_a_m_ * (p.y() - center_.y())};
  }

  PlotCanvas& canvas_;
  Eigen::Vector2d center_;
  PlotPoint middle_;
  double px_a_m_;
};

void DrawLegend(const MergePicture& picture, PlotCanvas& canvas) {
  double y_px = kHead_px + kPanel_px + 0.5 * kLine_px;
  for (std::size_t i = 0; i < picture.sessions.size(); ++i, y_px += kLine_px) {
    DrawDashed(canvas, {kMargin_px, y_px}, {kMargin_px + 30.0, y_px}, LookOf(i), 3.0, 0.0);
    canvas.Text({kMargin_px + 40.0, y_px}, picture.sessions[i].name, kInk, TextAnchor::kLeft);
  }
  if (picture.tiles.empty()) return;
  canvas.Line({kMargin_px + 5.0, y_px}, {kMargin_px + 25.0, y_px}, kTile, 10.0);
  canvas.Text({kMargin_px + 40.0, y_px}, "tiles to be fused again", kInk, TextAnchor::kLeft);
}

}  // namespace

Image DrawMerge(const MergePicture& picture) {
  const std::size_t lines = picture.sessions.size() + (picture.tiles.empty() ? 0 : 1);
  const double legend_px = kLine_px * static_cast<double>(lines + 1);
  ImageCanvas canvas(static_cast<std::uint32_t>(2.0 * kPanel_px),
                     static_cast<std::uint32_t>(kHead_px + kPanel_px + legend_px));
  canvas.Text({0.5 * kPanel_px, 0.5 * kHead_px}, "before", kInk, TextAnchor::kMiddle);
  canvas.Text({1.5 * kPanel_px, 0.5 * kHead_px}, "after", kInk, TextAnchor::kMiddle);
  const Eigen::AlignedBox2d bounds = BoundsOf(picture);
  if (!bounds.isEmpty()) {
    Panel before(bounds, 0.0, canvas);
    Panel after(bounds, kPanel_px, canvas);
    for (const Eigen::AlignedBox2d& tile : picture.tiles) after.Tile(tile);
    before.Closures(picture.closures_before);
    after.Closures(picture.closures_after);
    for (std::size_t i = 0; i < picture.sessions.size(); ++i) {
      before.Way(picture.sessions[i].before, LookOf(i));
      after.Way(picture.sessions[i].after, LookOf(i));
    }
    before.Scale();
  }
  DrawLegend(picture, canvas);
  return std::move(canvas.image);
}

}  // namespace atlas
