#include "server/net/peer_record.h"

#include <spdlog/spdlog.h>

namespace atlas {

void PeerRecord::Warn(const std::string& message) const {
  const auto left_out = lines.warnings.Take(LineBudget::Clock::now());
  if (left_out) {
    spdlog::warn("{}", Line(message + LineBudget::LeftOutText(*left_out)).text());
  }
}

}  // namespace atlas
