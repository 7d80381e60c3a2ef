#include "client/cli/commands/drive/health_strip.h"

#include <algorithm>
#include <string>

namespace atlas {
namespace {

constexpr Rgb kGood{140, 200, 140};
constexpr Rgb kWeak{245, 166, 35};
constexpr Rgb kLost{214, 39, 40};

PlotStrip::State StateOf(LocalizationHealth health, Rgb color) {
  return {std::string(LocalizationHealthName(health)), color};
}

// From one scan to the next where none was left out.
double StepOf(std::span<const LocalizedScan> scans) {
  double step = 0.0;
  for (std::size_t i = 1; i < scans.size(); ++i) {
    const double apart = static_cast<double>(scans[i].scan) - scans[i - 1].scan;
    if (apart > 0.0 && (step == 0.0 || apart < step)) step = apart;
  }
  return step == 0.0 ? 1.0 : step;
}

}  // namespace

PlotStrip HealthStrip(std::span<const LocalizedScan> scans) {
  using Health = LocalizationHealth;
  PlotStrip strip;
  strip.name = "health";
  strip.states = {StateOf(Health::kGood, kGood), StateOf(Health::kWeak, kWeak),
                  StateOf(Health::kLost, kLost)};
  const double half_step = 0.5 * StepOf(scans);
  for (const LocalizedScan& scan : scans) {
    const auto state = static_cast<std::size_t>(scan.located.health);
    const double from = scan.scan - half_step;
    const double to = scan.scan + half_step;
    if (!strip.parts.empty() && strip.parts.back().state == state &&
        strip.parts.back().to >= from) {
      strip.parts.back().to = std::max(strip.parts.back().to, to);
    } else {
      strip.parts.push_back({from, to, state});
    }
  }
  return strip;
}

}  // namespace atlas
