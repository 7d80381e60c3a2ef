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
// Told apart by those who see no red or green, too (Okabe and Ito).
constexpr std::array<Rgb, 7> kColors{{{0, 114, 178},
                                      {213, 94, 0},
                                      {0, 158, 115},
                                      {204, 121, 167},
                                      {86, 180, 233},
                                      {230, 159, 0},
                                      {0, 0, 0}}};

Eigen::AlignedBox2d BoundsOf(const MergePicture& picture) {
  Eigen::AlignedBox2d bounds;
  for (const PictureSession& session : picture.sessions) {
    for (const Eigen::Vector2d& p : session.before) bounds.extend(p);
    for (const Eigen::Vector2d& p : session.after) bounds.extend(p);
  }
  return bounds;
}

// From the world to a panel whose left edge is at `left_px`; north is up.
class Panel {
 public:
  Panel(const Eigen::AlignedBox2d& bounds, double left_px, PlotCanvas& canvas)
      : canvas_(canvas),
        center_(bounds.center()),
        middle_{left_px + 0.5 * kPanel_px, kHead_px + 0.5 * kPanel_px},
        px_a_m_((kPanel_px - 2.0 * kMargin_px) / std::max(1.0, bounds.sizes().maxCoeff())) {}

  void Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Rgb color, double width_px) {
    canvas_.Line(At(from), At(to), color, width_px);
  }

  void Way(const std::vector<Eigen::Vector2d>& points, Rgb color) {
    constexpr double kJump_m = 10.0;  // nobody drove it
    for (std::size_t i = 1; i < points.size(); ++i) {
      if ((points[i] - points[i - 1]).norm() <= kJump_m) Line(points[i - 1], points[i], color, 2.0);
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
  for (std::size_t i = 0; i < picture.sessions.size(); ++i) {
    const double y_px = kHead_px + kPanel_px + kLine_px * (static_cast<double>(i) + 0.5);
    const Rgb color = kColors[i % kColors.size()];
    canvas.Line({kMargin_px, y_px}, {kMargin_px + 30.0, y_px}, color, 3.0);
    canvas.Text({kMargin_px + 40.0, y_px}, picture.sessions[i].name, kInk, TextAnchor::kLeft);
  }
}

}  // namespace

Image DrawMerge(const MergePicture& picture) {
  const double legend_px = kLine_px * static_cast<double>(picture.sessions.size() + 1);
  ImageCanvas canvas(static_cast<std::uint32_t>(2.0 * kPanel_px),
                     static_cast<std::uint32_t>(kHead_px + kPanel_px + legend_px));
  canvas.Text({0.5 * kPanel_px, 0.5 * kHead_px}, "before", kInk, TextAnchor::kMiddle);
  canvas.Text({1.5 * kPanel_px, 0.5 * kHead_px}, "after", kInk, TextAnchor::kMiddle);
  const Eigen::AlignedBox2d bounds = BoundsOf(picture);
  if (!bounds.isEmpty()) {
    Panel before(bounds, 0.0, canvas);
    Panel after(bounds, kPanel_px, canvas);
    for (const auto& [from, to] : picture.closures_before) before.Line(from, to, kClosure, 1.0);
    for (const auto& [from, to] : picture.closures_after) after.Line(from, to, kClosure, 1.0);
    for (std::size_t i = 0; i < picture.sessions.size(); ++i) {
      before.Way(picture.sessions[i].before, kColors[i % kColors.size()]);
      after.Way(picture.sessions[i].after, kColors[i % kColors.size()]);
    }
    before.Scale();
  }
  DrawLegend(picture, canvas);
  return std::move(canvas.image);
}

}  // namespace atlas
