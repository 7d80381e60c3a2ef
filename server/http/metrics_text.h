// The daemon's numbers in the text format of Prometheus, version 0.0.4 (docs/daemon.md, "Metrics").
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/net/net_counters.h"
#include "server/service/atlas_service.h"
#include "server/store/upload_limits.h"
#include "server/store/write_figures.h"

namespace atlas {

inline constexpr const char* kMetricsContentType = "text/plain; version=0.0.4; charset=utf-8";

struct DaemonFigures {
  std::optional<ServiceStatus> atlas;  // none: it cannot be read now
  NetFigures net;
  WriteFigures writes;
  RoomFigures room;
  std::uint64_t rss_bytes = 0;
};

std::string MetricsText(const DaemonFigures& figures);

}  // namespace atlas
