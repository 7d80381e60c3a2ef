// How the cost of a pose update and the memory grow with the map: keyframes one a metre along a
// winding way that comes back to where it was after 50 m, and batches of ten corrected ones. One
// JSON line. The updates go all over the map, so that a small one has all that they need in memory,
// and a large one nothing. Therefore the same again where it is so for each size: places that were
// corrected just before, and the first update of a daemon that was started again.
// Usage: scaling_bench KEYFRAMES [SURVEY_MIB]: as atlasd's survey_mib, whose default is the default
// The worlds of the keyframes are drawn (tests/core/support/keyframe_worlds.h), not simulated: what
// they hold does not matter here, and ten thousand of them would take a while.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include <sys/resource.h>

#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/bench/updates/atlas_at_work.h"
#include "tests/bench/updates/quantile.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {
namespace {

constexpr std::int32_t kRadiusCells = 200;
constexpr std::uint32_t kWorlds = 50;  // that differ
constexpr std::uint32_t kCorrected = 10;
constexpr std::uint32_t kUpdates = 20;
constexpr double kRow_m = 50.0;  // of a way to and fro, 3 m beside the last one each time
constexpr std::uint32_t kPlaceKeyframes = 100;  // two such rows

// Rows of 50 keyframes, two passes of each row, then on to another place 100 m away: the smallest
// map is as dense as the largest.
QuantizedPose PoseOf(std::uint32_t i, double shift_m) {
  const double along_m = i % static_cast<std::uint32_t>(kRow_m);
  const std::uint32_t row = i / static_cast<std::uint32_t>(kRow_m);
  const double x_m = row % 2 == 0 ? along_m : kRow_m - along_m;
  const double y_m = 100.0 * (row / 2) + 3.0 * (row % 2);
  Pose T_world_sensor = Pose::Identity();
  T_world_sensor.translation() = Eigen::Vector3d(x_m, y_m + shift_m, 1.8);
  return QuantizedPose::FromPose(T_world_sensor);
}

KeyframeKey KeyOf(std::uint32_t i) {
  return {{"car", StrCat("row.", i / static_cast<std::uint32_t>(kRow_m))}, i};
}

double PeakMegabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

Status Fill(AtlasAtWork& atlas, const MapProfile& profile, std::uint32_t keyframes) {
  std::vector<Bytes> blobs;
  for (std::uint32_t i = 0; i < kWorlds; ++i) {
    blobs.push_back(EncodeKeyframe(StreetKeyframe(profile, kRadiusCells, i)));
  }
  for (std::uint32_t begin = 0; begin < keyframes; begin += 100) {
    std::vector<UploadRequest> uploads;
    for (std::uint32_t i = begin; i < std::min(begin + 100, keyframes); ++i) {
      uploads.push_back({KeyOf(i), 1000 * std::int64_t{i}, PoseOf(i, 0.0), {}, blobs[i % kWorlds]});
    }
    const auto done = atlas.UploadAll(std::move(uploads));
    if (!done) return done.error();
  }
  return {};
}

struct Costs {
  std::vector<double> cpu_ms;
  double tiles = 0;
};

// The same ten keyframes of a place each time, by another shift in each round.
PoseBatchRequest Correction(std::uint32_t keyframes, std::uint32_t update, double shift_m) {
  PoseBatchRequest batch;
  batch.author = "scaling_bench";
  const std::uint32_t place = keyframes / kPlaceKeyframes * update / kUpdates;  // all over the map
  const std::uint32_t first =
      place * kPlaceKeyframes + 37 * update % (kPlaceKeyframes - kCorrected + 1);
  for (std::uint32_t i = first; i < first + kCorrected; ++i) {
    batch.updates.push_back({KeyOf(i), PoseOf(i, shift_m)});
  }
  return batch;
}

Status Measure(AtlasAtWork& atlas, PoseBatchRequest batch, Costs& costs) {
  const auto cost = atlas.UpdatePoses(std::move(batch));
  if (!cost) return cost.error();
  costs.cpu_ms.push_back(cost->cpu_ms);
  costs.tiles += static_cast<double>(cost->tiles);
  return {};
}

// In a small map a round's later updates move some keyframes of its former ones a second time.
double Shift_m(std::uint32_t round, std::uint32_t update) {
  return 0.05 * (update + 1) + 0.01 * round;
}

Status MeasureAgain(AtlasAtWork& atlas, std::uint32_t keyframes, Costs& again) {
  for (std::uint32_t update = 0; update < kUpdates; ++update) {
    Costs first;
    ATLAS_RETURN_IF_ERROR(Measure(atlas, Correction(keyframes, update, Shift_m(1, update)), first));
    ATLAS_RETURN_IF_ERROR(Measure(atlas, Correction(keyframes, update, Shift_m(2, update)), again));
  }
  return {};
}

Status MeasureRestarted(AtlasAtWork& atlas, std::uint32_t keyframes, Costs& restarted) {
  for (std::uint32_t update = 0; update < kUpdates; ++update) {
    atlas.Restart();
    ATLAS_RETURN_IF_ERROR(
        Measure(atlas, Correction(keyframes, update, Shift_m(3, update)), restarted));
  }
  return {};
}

Status Run(std::uint32_t keyframes, std::size_t survey_mib) {
  const MapProfile profile;
  FusionOptions fusion;
  fusion.building.surveys = SurveyCacheLimits::OfTotal(survey_mib << 20);
  AtlasAtWork atlas(profile, fusion);
  ATLAS_RETURN_IF_ERROR(Fill(atlas, profile, keyframes));
  const double filled_mb = PeakMegabytes();
  Costs costs;
  for (std::uint32_t update = 0; update < kUpdates; ++update) {
    ATLAS_RETURN_IF_ERROR(Measure(atlas, Correction(keyframes, update, Shift_m(0, update)), costs));
  }
  const double peak_mb = PeakMegabytes();
  Costs again;
  Costs restarted;
  ATLAS_RETURN_IF_ERROR(MeasureAgain(atlas, keyframes, again));
  ATLAS_RETURN_IF_ERROR(MeasureRestarted(atlas, keyframes, restarted));
  const auto status = atlas.service().ReadStatus();
  if (!status) return status.error();
  std::cout << "{\"keyframes\": " << keyframes << ", \"tiles\": " << status->counts.tiles
            << ", \"tiles_per_update\": " << costs.tiles / kUpdates
            << ", \"cpu_ms_p50\": " << Quantile(costs.cpu_ms, 0.5)
            << ", \"cpu_ms_max\": " << Quantile(costs.cpu_ms, 1.0)
            << ", \"cpu_ms_p50_again\": " << Quantile(again.cpu_ms, 0.5)
            << ", \"cpu_ms_p50_restarted\": " << Quantile(restarted.cpu_ms, 0.5)
            << ", \"peak_mb_filled\": " << filled_mb << ", \"peak_mb\": " << peak_mb
            << ", \"store_mb\": " << static_cast<double>(status->counts.store_bytes) / 1048576.0
            << "}" << std::endl;
  return {};
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  const int keyframes = argc > 1 ? std::atoi(argv[1]) : 0;
  const int survey_mib = argc > 2 ? std::atoi(argv[2]) : 1'024;
  if (keyframes < static_cast<int>(atlas::testing::kPlaceKeyframes) || survey_mib < 0) {
    std::cerr << "usage: scaling_bench KEYFRAMES (100 or more) [SURVEY_MIB]\n";
    return 2;
  }
  const auto status = atlas::testing::Run(static_cast<std::uint32_t>(keyframes),
                                          static_cast<std::size_t>(survey_mib));
  if (!status.ok()) {
    std::cerr << "scaling_bench: " << status.message() << "\n";
    return 1;
  }
  return 0;
}
