#include "client/cli/commands/drive/track_output.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "client/cli/commands/drive/health_strip.h"
#include "client/cli/files/whole_file.h"
#include "client/drive/relocalization_file.h"
#include "client/render/image.h"
#include "client/render/plot/line_plot.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr Rgb kBlue{31, 119, 180};
constexpr Rgb kOrange{255, 127, 14};
constexpr Rgb kGreen{44, 160, 44};
constexpr Rgb kViolet{148, 103, 189};

template <typename Value>
PlotCurve CurveOf(const std::string& name,
                  Rgb color,
                  const std::vector<LocalizedScan>& scans,
                  const Value& value) {
  PlotCurve curve{name, color, {}};
  for (const LocalizedScan& scan : scans) {
    // Kilometres off would leave nothing to see of the rest: failures are ticks.
    const double y = scan.is_failure ? std::numeric_limits<double>::quiet_NaN() : value(scan);
    if (scan.is_after_jump) curve.points.emplace_back(scan.scan, std::nan(""));
    curve.points.emplace_back(scan.scan, y);
  }
  return curve;
}

LinePlot PlotOf(const std::vector<LocalizedScan>& scans, const std::string& title) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  using Scan = LocalizedScan;
  LinePlot plot;
  plot.title = title;
  plot.x_label = "scan";
  plot.panels = {
      {"error, m",
       {CurveOf("along", kBlue, scans, [](const Scan& scan) { return scan.offset.along_m; }),
        CurveOf("across", kOrange, scans, [](const Scan& scan) { return scan.offset.left_m; }),
        CurveOf("up", kGreen, scans, [](const Scan& scan) { return scan.offset.up_m; })}},
      {"error, deg",
       {CurveOf("yaw", kBlue, scans,
                [](const Scan& scan) { return scan.offset.yaw_rad * kDegrees; })}},
      {"fit", {CurveOf("fit", kViolet, scans, [](const Scan& scan) { return scan.located.fit; })}}};
  plot.strip = HealthStrip(scans);
  for (const Scan& scan : scans) {
    if (scan.is_after_jump) plot.marks.push_back(scan.scan);
    if (scan.is_failure) plot.flags.push_back(scan.scan);
  }
  return plot;
}

}  // namespace

void TrackOutput::Declare(ArgumentSet& arguments) {
  arguments.Optional("--output", "FILE.csv|.tum|.kitti", text_file_,
                     "Write each scan's pose and error (.csv), or the trajectory; of "
                     "--perturb and --relocalize .csv alone");
  arguments.Optional("--plot", "FILE.png|.svg", plot_file_, "Draw the errors along the drive");
}

Status TrackOutput::Check(LocalizationKind kind) {
  kind_ = kind;
  if (!text_file_.empty()) ATLAS_RETURN_IF_ERROR(CheckText());
  return plot_file_.empty() ? Status() : CheckPlot();
}

Status TrackOutput::CheckText() {
  const Result<TrackFormat> format = TrackFormatOf(text_file_);
  if (!format) return format.error();
  format_ = *format;
  if (*format != TrackFormat::kCsv && kind_ != LocalizationKind::kTracked) {
    return {StatusCode::kInvalidArgument,
            StrCat(text_file_,
                   ": scans that are each found alone are no trajectory; give a name "
                   "with .csv")};
  }
  return CheckPlace(text_file_);
}

Status TrackOutput::CheckPlot() {
  if (kind_ == LocalizationKind::kRelocalized) {
    return {StatusCode::kInvalidArgument, "--plot draws what starts somewhere: not --relocalize"};
  }
  is_svg_ = plot_file_.ends_with(".svg");
  if (!is_svg_ && !plot_file_.ends_with(".png")) {
    return {StatusCode::kInvalidArgument,
            StrCat(plot_file_, ": expected a name that ends in .png or .svg")};
  }
  return CheckPlace(plot_file_);
}

std::string TrackOutput::Text() const {
  return kind_ == LocalizationKind::kRelocalized ? RelocalizationText(relocalized_)
                                                 : TrackText(*format_, scans_);
}

Status TrackOutput::Write(const std::string& title) const {
  if (format_) ATLAS_RETURN_IF_ERROR(WriteTextFile(text_file_, Text()));
  return plot_file_.empty() ? Status() : WritePlot(title);
}

std::string TrackOutput::Told() const {
  return StrCat(text_file_.empty() ? plot_file_ : text_file_, " has what came before, ", lines(),
                lines() == 1 ? " line" : " lines");
}

Status TrackOutput::WritePlot(const std::string& title) const {
  const LinePlot plot = PlotOf(scans_, title);
  return is_svg_ ? WriteTextFile(plot_file_, PlotSvg(plot)) : WritePng(DrawPlot(plot), plot_file_);
}

}  // namespace atlas
