#include "tests/bench/updates/map_traffic.h"

#include <chrono>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/await.h"
#include "tests/bench/updates/quantile.h"

namespace atlas::testing {
namespace {

constexpr std::int64_t kRadius_um = 20'000'000;

using Clock = std::chrono::steady_clock;

double MsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

}  // namespace

MapTraffic::MapTraffic(AtlasService& service, std::vector<UploadRequest> uploads)
    : service_(service),
      uploads_(std::move(uploads)),
      query_thread_([this] { Query(); }),
      upload_thread_([this] { Upload(); }) {}

void MapTraffic::Stop() {
  is_stopping_ = true;
  if (query_thread_.joinable()) query_thread_.join();
  if (upload_thread_.joinable()) upload_thread_.join();
}

std::string MapTraffic::Report() const {
  return StrCat(
      ", \"queries\": ", query_ms_.size(), ", \"query_ms_p50\": ", Quantile(query_ms_, 0.5),
      ", \"query_ms_p99\": ", Quantile(query_ms_, 0.99), ", \"uploads\": ", upload_ms_.size(),
      ", \"acknowledged_ms_p50\": ", Quantile(upload_ms_, 0.5),
      ", \"acknowledged_ms_max\": ", Quantile(upload_ms_, 1.0), ", \"failed\": ", failed_.load());
}

void MapTraffic::Query() {
  for (std::size_t i = 0; !is_stopping_; i += 37) {
    const QuantizedPose& pose = uploads_[i % uploads_.size()].pose;
    RegionRequest request;
    request.disc = RegionDisc{pose.x_um, pose.y_um, kRadius_um};
    const auto begin = Clock::now();
    RegionQuery::Options options;
    options.tile_cost = [](const StoredTile& tile) {
      return tile.blob.size();
    };
    auto query = service_.Query(request, std::move(options));
    bool is_good = query.has_value();
    while (is_good) {
      const auto tile = service_.NextTile(*query);
      is_good = tile.has_value();
      if (!is_good || !*tile) break;
    }
    failed_ += is_good ? 0 : 1;
    query_ms_.push_back(MsSince(begin));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

void MapTraffic::Upload() {
  for (std::size_t i = 0; !is_stopping_ && i < uploads_.size(); ++i) {
    const auto begin = Clock::now();
    const auto result =
        Await<PutKeyframeResult>([&](auto done) { service_.Upload(uploads_[i], std::move(done)); });
    failed_ += result ? 0 : 1;
    upload_ms_.push_back(MsSince(begin));
    std::this_thread::sleep_until(begin + std::chrono::seconds(1));
  }
}

}  // namespace atlas::testing
