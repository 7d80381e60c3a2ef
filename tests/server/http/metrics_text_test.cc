// Figures as metrics: every line of the format, names and units as docs/daemon.md has them.
#include "server/http/metrics_text.h"

#include <gtest/gtest.h>

#include "tests/server/http/metrics_lines.h"

namespace atlas {
namespace {

std::size_t IndexOf(StatusCode code) {
  return static_cast<std::size_t>(code);
}

TEST(MetricsTextTest, FiguresAreShownAsTheyAre) {
  DaemonFigures figures;
  figures.atlas.emplace();
  figures.atlas->counts.revision = 123'456'789'012;
  figures.atlas->counts.dirty_tiles = 5;
  figures.atlas->damaged_tiles = 2;
  figures.atlas->counts.quarantined = 8;
  figures.atlas->building_s = 1.5;
  figures.rss_bytes = 1u << 30;
  figures.net.connections = 3;
  figures.net.refused = 4;
  figures.net.handshakes_failed = 7;
  figures.net.broken_frames = 8;
  figures.net.late_connections = {3, 2, 1};
  figures.writes.queued = 6;
  figures.room.used_bytes = 7;
  figures.room.limits = {8, 9, 10};
  figures.room.free_disk_bytes = 11;
  figures.room.refused = {12, 13, 14};
  const auto metrics = ParseMetrics(MetricsText(figures));
  EXPECT_EQ(metrics.at("roadatlas_atlas_readable"), 1);
  EXPECT_EQ(metrics.at("roadatlas_revision"), 123'456'789'012);
  EXPECT_EQ(metrics.at("roadatlas_dirty_tiles"), 5);
  EXPECT_EQ(metrics.at("roadatlas_damaged_tiles"), 2);
  EXPECT_EQ(metrics.at("roadatlas_quarantined_sessions"), 8);
  EXPECT_EQ(metrics.at("roadatlas_fusion_seconds_total"), 1.5);
  EXPECT_EQ(metrics.at("roadatlas_resident_bytes"), 1u << 30);
  EXPECT_EQ(metrics.at("roadatlas_connections"), 3);
  EXPECT_EQ(metrics.at("roadatlas_connections_refused_total"), 4);
  EXPECT_EQ(metrics.at("roadatlas_tls_handshakes_failed_total"), 7);
  EXPECT_EQ(metrics.at("roadatlas_broken_frames_total"), 8);
  EXPECT_EQ(metrics.at("roadatlas_connections_late_total{cause=\"replies\"}"), 3);
  EXPECT_EQ(metrics.at("roadatlas_connections_late_total{cause=\"silence\"}"), 1);
  EXPECT_EQ(metrics.at("roadatlas_store_writes_queued"), 6);
  EXPECT_EQ(metrics.at("roadatlas_store_used_bytes"), 7);
  EXPECT_EQ(metrics.at("roadatlas_store_limit_bytes"), 8);
  EXPECT_EQ(metrics.at("roadatlas_vehicle_limit_bytes"), 9);
  EXPECT_EQ(metrics.at("roadatlas_disk_floor_bytes"), 10);
  EXPECT_EQ(metrics.at("roadatlas_disk_free_bytes"), 11);
  EXPECT_EQ(metrics.at(R"(roadatlas_uploads_refused_total{reason="disk_floor"})"), 12);
  EXPECT_EQ(metrics.at(R"(roadatlas_uploads_refused_total{reason="store_limit"})"), 13);
  EXPECT_EQ(metrics.at(R"(roadatlas_uploads_refused_total{reason="quota"})"), 14);
}

TEST(MetricsTextTest, AnAtlasThatCannotBeReadLeavesTheRest) {
  const auto metrics = ParseMetrics(MetricsText({}));
  EXPECT_EQ(metrics.at("roadatlas_atlas_readable"), 0);
  EXPECT_EQ(metrics.count("roadatlas_revision"), 0u);
  EXPECT_EQ(metrics.count("roadatlas_disk_free_bytes"), 0u);
  EXPECT_EQ(metrics.at("roadatlas_connections"), 0);
}

TEST(MetricsTextTest, RequestsAreCountedByKindAndOutcome) {
  DaemonFigures figures;
  auto& sync = figures.net.kinds[static_cast<std::size_t>(RequestKind::kSync)];
  sync.requests[IndexOf(StatusCode::kOk)] = 7;
  sync.requests[IndexOf(StatusCode::kInvalidArgument)] = 1;
  sync.late = 2;
  const auto metrics = ParseMetrics(MetricsText(figures));
  EXPECT_EQ(metrics.at(R"(roadatlas_requests_total{kind="sync",code="ok"})"), 7);
  EXPECT_EQ(metrics.at(R"(roadatlas_requests_total{kind="sync",code="invalid_argument"})"), 1);
  EXPECT_EQ(metrics.at(R"(roadatlas_requests_total{kind="hello",code="ok"})"), 0);
  EXPECT_EQ(metrics.count(R"(roadatlas_requests_total{kind="sync",code="internal"})"), 0u);
  EXPECT_EQ(metrics.at(R"(roadatlas_requests_deadline_exceeded_total{kind="sync"})"), 2);
  EXPECT_EQ(metrics.at(R"(roadatlas_requests_deadline_exceeded_total{kind="wait"})"), 0);
}

TEST(MetricsTextTest, AHistogramCountsUpToEachBound) {
  DaemonFigures figures;
  figures.writes.commits.counts = {2, 0, 3};
  figures.writes.commits.counts.back() = 1;
  figures.writes.commits.sum_s = 61.25;
  const auto metrics = ParseMetrics(MetricsText(figures));
  const std::string name = "roadatlas_store_commit_seconds";
  EXPECT_EQ(metrics.at(name + R"(_bucket{le="0.0005"})"), 2);
  EXPECT_EQ(metrics.at(name + R"(_bucket{le="0.001"})"), 5);
  EXPECT_EQ(metrics.at(name + R"(_bucket{le="60"})"), 5);
  EXPECT_EQ(metrics.at(name + R"(_bucket{le="+Inf"})"), 6);
  EXPECT_EQ(metrics.at(name + "_count"), 6);
  EXPECT_EQ(metrics.at(name + "_sum"), 61.25);
  EXPECT_EQ(metrics.at("roadatlas_store_commits_total"), 6);
}

}  // namespace
}  // namespace atlas
