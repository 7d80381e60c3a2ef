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
  figures.writes.queued = 6;
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
  EXPECT_EQ(metrics.at("roadatlas_store_writes_queued"), 6);
}

TEST(MetricsTextTest, AnAtlasThatCannotBeReadLeavesTheRest) {
  const auto metrics = ParseMetrics(MetricsText({}));
  EXPECT_EQ(metrics.at("roadatlas_atlas_readable"), 0);
  EXPECT_EQ(metrics.count("roadatlas_revision"), 0u);
  EXPECT_EQ(metrics.at("roadatlas_connections"), 0);
}

TEST(MetricsTextTest, RequestsAreCountedByKindAndOutcome) {
  DaemonFigures figures;
  auto& sync = figures.net.kinds[static_cast<std::size_t>(RequestKind::kSync)];
  sync.requests[IndexOf(StatusCode::kOk)] = 7;
  sync.requests[IndexOf(StatusCode::kInvalidArgument)] = 1;
  const auto metrics = ParseMetrics(MetricsText(figures));
  EXPECT_EQ(metrics.at(R"(roadatlas_requests_total{kind="sync",code="ok"})"), 7);
  EXPECT_EQ(metrics.at(R"(roadatlas_requests_total{kind="sync",code="invalid_argument"})"), 1);
  EXPECT_EQ(metrics.at(R"(roadatlas_requests_total{kind="hello",code="ok"})"), 0);
  EXPECT_EQ(metrics.count(R"(roadatlas_requests_total{kind="sync",code="internal"})"), 0u);
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
