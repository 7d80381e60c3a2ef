// How soon a keyframe is in the map: four vehicles upload one a second each, in real time, and each
// keyframe's way is timed from its acknowledgement until the tiles that it touches are served. One
// JSON line a keyframe, and one for all.
// Usage: online_bench street|overpass|garage RANGE_M SECONDS: 0 is the whole drive
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/base/str_cat.h"
#include "core/simulation/worlds/simulated_world.h"
#include "server/config/daemon_config.h"
#include "server/store/await.h"
#include "tests/bench/updates/atlas_at_work.h"
#include "tests/bench/updates/drive_uploads.h"
#include "tests/bench/updates/quantile.h"

namespace atlas::testing {
namespace {

constexpr int kVehicles = 4;

using Clock = std::chrono::steady_clock;

struct Arrival {
  int vehicle = 0;
  double at_s = 0;             // since the beginning
  double acknowledged_ms = 0;  // from the upload
  double served_ms = 0;        // from the acknowledgement
};

Result<std::vector<UploadRequest>> Drive(
    WorldKind kind, int vehicle, const MapProfile& profile, double range_m, std::size_t keyframes) {
  auto world = MakeWorld(kind);
  if (!world) return Error(world.error());
  DriveOptions options;
  options.seed = static_cast<std::uint64_t>(vehicle);  // odd ones come towards the others
  const auto drive = SimulatedDrive::Create(*std::move(world), options);
  if (!drive) return Error(drive.error());
  UploadOptions upload;
  upload.vehicle = StrCat("car.", vehicle);
  upload.range_m = range_m;
  upload.begin = static_cast<std::size_t>(vehicle) * 5;  // not all at the same place
  if (keyframes > 0) {
    upload.end = upload.begin + keyframes;
  }
  return MakeUploads(*drive, profile, upload);
}

class Fleet {
 public:
  Fleet(AtlasService& service, std::vector<std::vector<UploadRequest>> drives)
      : service_(service), drives_(std::move(drives)) {}

  Result<std::vector<Arrival>> Run() {
    begin_ = Clock::now();
    {
      std::vector<std::jthread> threads;
      for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
        threads.emplace_back([this, vehicle] { Vehicle(vehicle); });
      }
    }
    if (!status_.ok()) return Error(status_);
    return std::move(arrivals_);
  }

 private:
  // Evenly beside the others; what waits for the tiles does not keep the next keyframe waiting.
  void Vehicle(int vehicle) {
    std::vector<std::jthread> waiting;
    const auto offset = std::chrono::milliseconds(1000 * vehicle / kVehicles);
    std::vector<UploadRequest>& uploads = drives_[static_cast<std::size_t>(vehicle)];
    for (std::size_t i = 0; i < uploads.size(); ++i) {
      std::this_thread::sleep_until(begin_ + offset + std::chrono::seconds(i));
      const auto sent = Clock::now();
      const auto accepted = Await<PutKeyframeResult>(
          [&](auto done) { service_.Upload(std::move(uploads[i]), std::move(done)); });
      if (!accepted) {
        Fail(accepted.error());
        return;
      }
      const auto acknowledged = Clock::now();
      waiting.emplace_back([this, vehicle, sent, acknowledged, revision = accepted->revision] {
        const Status served = service_.WaitForRevision(revision, {std::chrono::minutes(1), {}});
        if (!served.ok()) {
          Fail(served);
          return;
        }
        const auto ms = [](auto from, auto to) {
          return std::chrono::duration<double, std::milli>(to - from).count();
        };
        const std::lock_guard lock(mutex_);
        arrivals_.push_back({vehicle, 1e-3 * ms(begin_, sent), ms(sent, acknowledged),
                             ms(acknowledged, Clock::now())});
      });
    }
  }
  void Fail(const Status& status) {
    const std::lock_guard lock(mutex_);
    status_ = status;
  }

  AtlasService& service_;
  std::vector<std::vector<UploadRequest>> drives_;
  Clock::time_point begin_;
  std::mutex mutex_;
  std::vector<Arrival> arrivals_;
  Status status_;
};

void Print(const std::string& world, double range_m, const std::vector<Arrival>& arrivals) {
  std::vector<double> served_ms;
  std::vector<double> acknowledged_ms;
  for (const Arrival& a : arrivals) {
    std::cout << "{\"vehicle\": " << a.vehicle << ", \"at_s\": " << a.at_s
              << ", \"acknowledged_ms\": " << a.acknowledged_ms
              << ", \"served_ms\": " << a.served_ms << "}\n";
    served_ms.push_back(a.served_ms);
    acknowledged_ms.push_back(a.acknowledged_ms);
  }
  std::cout << "{\"world\": \"" << world << "\", \"range_m\": " << range_m
            << ", \"keyframes\": " << arrivals.size()
            << ", \"acknowledged_ms_p99\": " << Quantile(acknowledged_ms, 0.99)
            << ", \"served_ms_p50\": " << Quantile(served_ms, 0.5)
            << ", \"served_ms_p99\": " << Quantile(served_ms, 0.99)
            << ", \"served_ms_max\": " << Quantile(served_ms, 1.0) << "}" << std::endl;
}

Status Run(const std::string& world, double range_m, int seconds) {
  const auto kind = WorldKindByName(world);
  if (!kind) return kind.error();
  const MapProfile profile;
  std::vector<std::vector<UploadRequest>> drives;
  for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
    auto uploads = Drive(*kind, vehicle, profile, range_m, static_cast<std::size_t>(seconds));
    if (!uploads) return uploads.error();
    drives.push_back(*std::move(uploads));
  }
  FusionOptions fusion;
  fusion.workers = std::max(1U, std::thread::hardware_concurrency());
  fusion.nice = DaemonConfig().fusion_nice;
  AtlasAtWork atlas(profile, fusion);
  const auto arrivals = Fleet(atlas.service(), std::move(drives)).Run();
  if (!arrivals) return arrivals.error();
  Print(world, range_m, *arrivals);
  return {};
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  if (argc != 4 || std::atoi(argv[3]) < 0) {
    std::cerr
        << "usage: online_bench street|overpass|garage RANGE_M SECONDS (0: the whole drive)\n";
    return 2;
  }
  const atlas::Status status = atlas::testing::Run(argv[1], std::atof(argv[2]), std::atoi(argv[3]));
  if (!status.ok()) {
    std::cerr << "online_bench: " << status.message() << "\n";
    return 1;
  }
  return 0;
}
