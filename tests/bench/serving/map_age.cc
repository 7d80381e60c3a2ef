#include "tests/bench/serving/map_age.h"

#include <chrono>
#include <cstddef>
#include <stop_token>
#include <thread>
#include <utility>

#include "client/connection/atlas_client.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::minutes kLongest{1};
constexpr std::chrono::milliseconds kPause{100};
constexpr double kPause_s = 0.1;

// A cell of the coarsest level, somewhere: what is waited for are the tiles of the whole atlas.
SyncQuery NearlyNothing(std::uint64_t revision) {
  SyncQuery query;
  query.area = BoxArea{{0.0, 0.0}, {0.1, 0.1}};
  query.finest_level = query.coarsest_level = 7;
  query.wait_revision = revision;
  query.timeout = kLongest;
  return query;
}

Result<double> WaitOnce(AtlasClient& client) {
  const auto status = client.ReadStatus();
  if (!status) {
    return Error(status.error());
  }
  const auto begin = Clock::now();
  const auto summary =
      client.Sync(NearlyNothing(status->revision), [](const TileBlob&) { return Status(); });
  if (!summary) {
    return Error(summary.error());
  }
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

}  // namespace

struct MapAge::Waiting {
  explicit Waiting(AtlasClient its_client) : client(std::move(its_client)) {}

  void Run(const std::stop_token& stop) {
    while (!stop.stop_requested() && status.ok()) {
      const auto waited_s = WaitOnce(client);
      if (waited_s) {
        const auto moments = 1 + static_cast<std::size_t>(*waited_s / kPause_s);
        all_s.insert(all_s.end(), moments, *waited_s);
        std::this_thread::sleep_for(kPause);
      } else {
        status = waited_s.error();
      }
    }
  }

  AtlasClient client;
  std::vector<double> all_s;
  Status status;
  std::jthread thread;
};

Result<MapAge> MapAge::Start(std::uint16_t port) {
  ConnectionOptions connection;
  connection.endpoint.port = port;
  connection.client_name = "map_age";
  auto client = AtlasClient::Connect(connection);
  if (!client) {
    return Error(client.error());
  }
  auto waiting = std::make_shared<Waiting>(*std::move(client));
  waiting->thread =
      std::jthread([its = waiting.get()](const std::stop_token& stop) { its->Run(stop); });
  return MapAge(std::move(waiting));
}

Result<std::vector<double>> MapAge::Stop() {
  waiting_->thread.request_stop();
  waiting_->thread.join();
  if (!waiting_->status.ok()) {
    return Error(waiting_->status);
  }
  return waiting_->all_s;
}

}  // namespace atlas::testing
