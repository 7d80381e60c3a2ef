#include "tests/client/link_faults/fault_plans.h"

#include <array>
#include <cmath>

namespace atlas::testing {

using std::chrono::milliseconds;

// Every connection fails, a quarter of them on both ways.
LinkPlan FaultPlans::operator()() {
  LinkPlan plan;
  plan.pace = DrawPace();
  const std::uint32_t way = Below(8);
  if (way < 5) plan.up = DrawCut(options_.max_bytes_up);
  if (way >= 3) plan.down = DrawCut(options_.max_bytes_down);
  if (Below(6) == 0) {
    const auto most_ms = static_cast<std::uint32_t>(options_.max_refused.count());
    plan.refused_after = milliseconds(1 + Below(most_ms));
  }
  return plan;
}

// Half of them as fast as the machine, the others as a mobile network.
LinkPace FaultPlans::DrawPace() {
  LinkPace pace;
  if (Below(2) == 0) return pace;
  pace.bits_per_s = 1e6 * (1 + Below(20));
  pace.latency = milliseconds(Below(6));
  return pace;
}

// After one byte as often as in the last half of them: in the handshake, in a frame's header, in a
// blob.
LinkCut FaultPlans::DrawCut(std::int64_t max_bytes) {
  constexpr std::array<LinkCut::Kind, 4> kKinds = {LinkCut::Kind::kReset, LinkCut::Kind::kReset,
                                                   LinkCut::Kind::kClose,
                                                   LinkCut::Kind::kHalfClose};
  LinkCut cut;
  const double part = 1e-6 * Below(1'000'001);
  cut.after_bytes = std::llround(std::pow(static_cast<double>(max_bytes), part));
  cut.kind = kKinds.at(Below(kKinds.size()));
  if (Below(4) > 0) return cut;
  cut.stall = milliseconds(1 + Below(static_cast<std::uint32_t>(options_.max_stall.count())));
  return cut;
}

}  // namespace atlas::testing
