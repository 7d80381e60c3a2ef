// What a new keyframe costs in the first, second, ... pass over the same place, from the upload to
// the fused tiles, one at a time with one worker: one JSON line a pass.
// Usage: passes_bench WORLD PRESET PASSES
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_codec.h"
#include "server/service/process_memory.h"
#include "tests/bench/accuracy/bench_drive.h"
#include "tests/bench/accuracy/drive_map.h"
#include "tests/bench/updates/atlas_at_work.h"

namespace atlas::testing {
namespace {

constexpr double kRange_m = 20.0;
constexpr std::int64_t kPass_ms = 3'600'000;

double Quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

// Every pass with its own noise and lane.
Result<std::vector<UploadRequest>> DrivePass(WorldKind world, int pass, const MapProfile& profile) {
  Result<SimulatedWorld> made = MakeWorld(world);
  if (!made) return Error(made.error());
  DriveOptions options;
  options.seed = 2 * static_cast<std::uint64_t>(pass);  // even: all in one direction
  const auto drive = SimulatedDrive::Create(*std::move(made), options);
  if (!drive) return Error(drive.error());
  const auto keyframes = BuildKeyframes(*drive, 0, drive->scans(), profile, kRange_m);
  if (!keyframes) return Error(keyframes.error());
  std::vector<UploadRequest> requests;
  for (const PlacedKeyframe& k : *keyframes) {
    UploadRequest request;
    request.key = {{"car", StrCat("pass.", pass, ".", k.key.session.session)}, k.key.sequence};
    request.time_ms = pass * kPass_ms + k.time_ms;
    request.pose = QuantizedPose::FromPose(drive->sensor_pose(k.key.sequence));
    request.blob = EncodeKeyframe(*k.keyframe);
    requests.push_back(std::move(request));
  }
  return requests;
}

Status RunPass(AtlasAtWork& atlas, WorldKind world, int pass, const MapProfile& profile) {
  auto requests = DrivePass(world, pass, profile);
  if (!requests) return requests.error();
  std::vector<double> cpu_ms;
  std::vector<double> wall_ms;
  std::uint64_t tiles = 0;
  for (UploadRequest& request : *requests) {
    const auto cost = atlas.Upload(std::move(request));
    if (!cost) return cost.error();
    cpu_ms.push_back(cost->cpu_ms);
    wall_ms.push_back(cost->wall_ms);
    tiles += cost->tiles;
  }
  double cpu_sum_ms = 0;
  for (const double ms : cpu_ms) cpu_sum_ms += ms;
  const auto status = atlas.service().ReadStatus();
  if (!status) return status.error();
  const auto keyframes = static_cast<double>(cpu_ms.size());
  std::cout << "{\"pass\": " << pass << ", \"preset\": \"" << FusionPresetName(profile.preset)
            << "\", \"keyframes\": " << cpu_ms.size()
            << ", \"tiles_per_keyframe\": " << static_cast<double>(tiles) / keyframes
            << ", \"cpu_ms\": " << cpu_sum_ms / keyframes
            << ", \"wall_ms_p50\": " << Quantile(wall_ms, 0.5)
            << ", \"wall_ms_p99\": " << Quantile(wall_ms, 0.99)
            << ", \"keyframe_bytes\": " << status->counts.keyframe_bytes
            << ", \"tile_bytes\": " << status->counts.tile_bytes
            << ", \"store_bytes\": " << status->counts.store_bytes
            << ", \"rss_bytes\": " << status->rss_bytes << "}" << std::endl;
  return {};
}

int Run(const std::string& world_name, const std::string& preset_name, int passes) {
  const auto world = WorldKindByName(world_name);
  const auto preset = FusionPresetByName(preset_name);
  if (!world || !preset || passes < 1) {
    std::cerr << "usage: passes_bench street|overpass|garage strict|bounded|paper PASSES\n";
    return 2;
  }
  MapProfile profile;
  profile.preset = *preset;
  AtlasAtWork atlas(profile, 1);
  for (int pass = 1; pass <= passes; ++pass) {
    if (const Status status = RunPass(atlas, *world, pass, profile); !status.ok()) {
      std::cerr << "pass " << pass << ": " << status.message() << "\n";
      return 1;
    }
  }
  return 0;
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() != 3) {
    return atlas::testing::Run("", "", 0);
  }
  return atlas::testing::Run(arguments[0], arguments[1], std::atoi(arguments[2].c_str()));
}
