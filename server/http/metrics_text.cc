#include "server/http/metrics_text.h"

#include <cstddef>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

namespace atlas {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Families = std::vector<MetricFamily>;
using Labels = std::vector<ClientMetric::Label>;

MetricFamily& Begin(Families& families, const char* name, const char* help, MetricType type) {
  families.push_back({std::string("roadatlas_") + name, help, type, {}});
  return families.back();
}

void AddCount(MetricFamily& family, Labels labels, double value) {
  ClientMetric metric;
  metric.label = std::move(labels);
  metric.counter.value = value;
  family.metric.push_back(std::move(metric));
}

template <typename Number>
void AddGauge(Families& families, const char* name, const char* help, Number value) {
  ClientMetric metric;
  metric.gauge.value = static_cast<double>(value);
  Begin(families, name, help, MetricType::Gauge).metric.push_back(metric);
}

template <typename Number>
void AddCounter(Families& families, const char* name, const char* help, Number value) {
  AddCount(Begin(families, name, help, MetricType::Counter), {}, static_cast<double>(value));
}

void AddDurations(MetricFamily& family, Labels labels, const DurationFigures& figures) {
  ClientMetric metric;
  metric.label = std::move(labels);
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < figures.counts.size(); ++i) {
    count += figures.counts[i];
    const double bound_s = i < kDurationBounds_s.size() ? kDurationBounds_s[i]
                                                        : std::numeric_limits<double>::infinity();
    metric.histogram.bucket.push_back({count, bound_s});
  }
  metric.histogram.sample_count = count;
  metric.histogram.sample_sum = figures.sum_s;
  family.metric.push_back(std::move(metric));
}

void AddAtlas(const ServiceStatus& status, Families& out) {
  const StoreCounts& counts = status.counts;
  AddGauge(out, "revision", "Revision of the atlas.", counts.revision);
  AddGauge(out, "keyframes", "Keyframes stored.", counts.keyframes);
  AddGauge(out, "keyframe_bytes", "Bytes of their blobs.", counts.keyframe_bytes);
  AddGauge(out, "tiles", "Tiles of all levels.", counts.tiles);
  AddGauge(out, "tile_bytes", "Bytes of their blobs.", counts.tile_bytes);
  AddGauge(out, "dirty_tiles", "Tiles to be fused again.", counts.dirty_tiles);
  AddGauge(out, "quarantined_sessions", "Sessions kept out of the map because they look wrong.",
           status.counts.quarantined);
  AddGauge(out, "damaged_tiles", "Dirty tiles that damage keeps from being fused.",
           status.damaged_tiles);
  AddGauge(out, "store_bytes", "Bytes of the atlas on disk.", counts.store_bytes);
  AddCounter(out, "fusion_tiles_total", "Tiles built.", status.tiles_built);
  AddCounter(out, "scrub_passes_total", "Times the whole atlas was read back.",
             status.scrub.passes);
  AddCounter(out, "scrub_checked_total", "Keyframes and tiles read back.", status.scrub.checked);
  AddCounter(out, "scrub_damaged_total", "What of it was damaged.", status.scrub.damaged);
  AddCounter(out, "fusion_seconds_total", "Time that all workers together spent on building.",
             status.building_s);
}

void AddLateConnections(const NetFigures& net, Families& out) {
  MetricFamily& family =
      Begin(out, "connections_late_total", "Connections closed because they were too slow.",
            MetricType::Counter);
  for (std::size_t i = 0; i < kLatenessNames.size(); ++i) {
    AddCount(family, {{"cause", std::string(kLatenessNames[i])}},
             static_cast<double>(net.late_connections[i]));
  }
}

void AddRequests(const NetFigures& net, Families& out) {
  MetricFamily& family = Begin(out, "requests_total", "Requests that ended.", MetricType::Counter);
  for (std::size_t kind = 0; kind < kRequestKinds; ++kind) {
    for (std::size_t code = 0; code < kStatusCodes; ++code) {
      const std::uint64_t count = net.kinds[kind].requests[code];
      if (count > 0 || code == 0) {  // a rate needs a beginning; most errors never come
        const std::string_view outcome = StatusCodeName(static_cast<StatusCode>(code));
        AddCount(family,
                 {{"kind", std::string(kRequestKindNames[kind])}, {"code", std::string(outcome)}},
                 static_cast<double>(count));
      }
    }
  }
}

void AddLateRequests(const NetFigures& net, Families& out) {
  MetricFamily& family =
      Begin(out, "requests_deadline_exceeded_total",
            "Requests whose deadline passed before they were done.", MetricType::Counter);
  for (std::size_t kind = 0; kind < kRequestKinds; ++kind) {
    AddCount(family, {{"kind", std::string(kRequestKindNames[kind])}},
             static_cast<double>(net.kinds[kind].late));
  }
}

void AddRequestDurations(const NetFigures& net, Families& out) {
  MetricFamily& family =
      Begin(out, "request_seconds", "From the last byte of a request to its last reply.",
            MetricType::Histogram);
  for (std::size_t kind = 0; kind < kRequestKinds; ++kind) {
    AddDurations(family, {{"kind", std::string(kRequestKindNames[kind])}},
                 net.kinds[kind].durations);
  }
}

void AddNet(const NetFigures& net, Families& out) {
  AddGauge(out, "connections", "Connections open.", net.connections);
  AddCounter(out, "connections_refused_total",
             "Connections closed where they were accepted: too many were open, were not "
             "greeted, or came of one address.",
             net.refused);
  AddCounter(out, "tls_handshakes_failed_total",
             "TLS handshakes that peers began and that did not succeed.", net.handshakes_failed);
  AddCounter(out, "broken_frames_total",
             "Frames that broke the protocol; each ended its connection.", net.broken_frames);
  AddLateConnections(net, out);
  AddRequests(net, out);
  AddLateRequests(net, out);
  AddRequestDurations(net, out);
  AddGauge(out, "requests_in_flight", "Requests that were read and are not answered yet.",
           net.in_flight);
  AddGauge(out, "held_bytes", "Bytes of requests and parts of them that are held.", net.held_bytes);
  AddGauge(out, "large_request_bytes",
           "Bytes of large requests that are not whole or wait to be read.", net.part_bytes);
  AddCounter(out, "large_requests_closed_total",
             "Large requests that were not whole and had to go, for the room they took.",
             net.parts_closed);
  AddGauge(out, "queued_reply_bytes", "Bytes of replies that wait for slow readers.",
           net.queued_bytes);
  AddCounter(out, "received_bytes_total", "Bytes from peers.", net.received_bytes);
  AddCounter(out, "sent_bytes_total", "Bytes to peers.", net.sent_bytes);
}

void AddWrites(const WriteFigures& writes, Families& out) {
  AddGauge(out, "store_writes_queued", "Writes that wait for the writer.", writes.queued);
  AddCounter(out, "store_commits_total", "Transactions written.", writes.commits.count());
  AddDurations(Begin(out, "store_commit_seconds", "Of a transaction, until it is on disk.",
                     MetricType::Histogram),
               {}, writes.commits);
}

void AddRoom(const RoomFigures& room, Families& out) {
  AddGauge(out, "store_used_bytes", "Pages of the database that are in use.", room.used_bytes);
  AddGauge(out, "store_limit_bytes", "What uploads may fill of them; 0: no limit.",
           room.limits.store_bytes);
  AddGauge(out, "vehicle_limit_bytes", "What one vehicle's keyframes may take; 0: no limit.",
           room.limits.vehicle_bytes);
  AddGauge(out, "disk_floor_bytes", "What uploads leave free on the disk; 0: nothing.",
           room.limits.disk_floor_bytes);
  if (room.free_disk_bytes) {
    AddGauge(out, "disk_free_bytes", "Free on the atlas's disk.", *room.free_disk_bytes);
  }
  MetricFamily& refused = Begin(out, "uploads_refused_total", "Keyframes refused for want of room.",
                                MetricType::Counter);
  for (std::size_t why = 0; why < kUploadRefusals; ++why) {
    AddCount(refused, {{"reason", std::string(StatusReasonName(kUploadRefusalReasons[why]))}},
             static_cast<double>(room.refused[why]));
  }
}

}  // namespace

std::string MetricsText(const DaemonFigures& figures) {
  Families families;
  AddGauge(families, "atlas_readable", "1 when the atlas could be read, else 0.",
           figures.atlas ? 1 : 0);
  if (figures.atlas) {
    AddAtlas(*figures.atlas, families);
  }
  AddGauge(families, "resident_bytes", "Memory of the process.", figures.rss_bytes);
  AddNet(figures.net, families);
  AddWrites(figures.writes, families);
  AddRoom(figures.room, families);
  return prometheus::TextSerializer().Serialize(families);
}

}  // namespace atlas
