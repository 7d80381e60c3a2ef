#include "tests/bench/memory/map_readers.h"

#include <future>
#include <random>

#include "client/connection/atlas_client.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kQueryEvery = 8;

Status Drop(const TileBlob& /*tile*/) {
  return {};
}

Status Query(AtlasClient& client, const DiscArea& disc, ReadersReport& report) {
  RegionQuery query;
  query.disc = {disc.center_m, disc.radius_m};
  const auto reply = client.QueryRegion(query, &Drop);
  if (!reply) return reply.error();
  ++report.queries;
  report.tiles += reply->tiles;
  report.bytes += reply->bytes;
  return {};
}

Status Sync(AtlasClient& client, const DiscArea& disc, ReadersReport& report) {
  SyncQuery query;
  query.area = disc;
  const auto reply = client.Sync(query, &Drop);
  if (!reply) return reply.error();
  ++report.syncs;
  report.tiles += reply->tiles;
  report.bytes += reply->bytes;
  return {};
}

Result<ReadersReport> ReadOn(const ReadersOptions& options, std::uint32_t seed) {
  ConnectionOptions connection;
  connection.endpoint = options.endpoint;
  auto client = AtlasClient::Connect(connection);
  if (!client) return Error(client.error());
  std::mt19937 random(seed);
  ReadersReport report;
  const Clock::time_point end = Clock::now() + options.time;
  for (std::uint64_t request = 1; Clock::now() < end; ++request) {
    const DiscArea disc{options.places_m[random() % options.places_m.size()], options.radius_m};
    Status status =
        request % kQueryEvery == 0 ? Query(*client, disc, report) : Sync(*client, disc, report);
    if (!status.ok()) return Error(std::move(status));
  }
  return report;
}

}  // namespace

Result<ReadersReport> ReadMaps(const ReadersOptions& options) {
  std::vector<std::future<Result<ReadersReport>>> readers;
  for (int i = 0; i < options.connections; ++i) {
    readers.push_back(std::async(std::launch::async, &ReadOn, options, i));
  }
  ReadersReport sum;
  Status failure;
  for (auto& reader : readers) {
    const Result<ReadersReport> report = reader.get();
    if (!report) {
      failure = report.error();
      continue;
    }
    sum.syncs += report->syncs;
    sum.queries += report->queries;
    sum.tiles += report->tiles;
    sum.bytes += report->bytes;
  }
  return failure.ok() ? Result<ReadersReport>(sum) : Error(std::move(failure));
}

}  // namespace atlas::testing
