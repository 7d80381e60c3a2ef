// What a new keyframe costs in the first, second, ... pass over the same place, from the upload to
// the fused tiles, one at a time with one worker: one JSON line a pass.
// Usage: passes_bench WORLD PRESET PASSES [VEHICLES [correct|restart|restart-cold]]; with several
// they take turns. With `correct`: also what it costs after each pass to correct two keyframes of
// the first one, and two of the latest. With `restart`: the daemon is started again before each
// pass; with `restart-cold`, its surveys are not kept on disk.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "core/simulation/worlds/simulated_world.h"
#include "tests/bench/updates/atlas_at_work.h"
#include "tests/bench/updates/drive_uploads.h"
#include "tests/bench/updates/quantile.h"

namespace atlas::testing {
namespace {

constexpr std::int64_t kPass_ms = 3'600'000;

// Every pass with its own noise and lane.
Result<std::vector<UploadRequest>> DrivePass(WorldKind world,
                                             int pass,
                                             int vehicles,
                                             const MapProfile& profile) {
  Result<SimulatedWorld> made = MakeWorld(world);
  if (!made) return Error(made.error());
  DriveOptions options;
  options.seed = 2 * static_cast<std::uint64_t>(pass);  // even: all in one direction
  const auto drive = SimulatedDrive::Create(*std::move(made), options);
  if (!drive) return Error(drive.error());
  UploadOptions upload;
  upload.vehicle = vehicles == 1 ? "car" : StrCat("car.", pass % vehicles);
  upload.session = StrCat("pass.", pass);
  upload.start_ms = pass * kPass_ms;
  return MakeUploads(*drive, profile, upload);
}

using Placed = std::vector<PoseBatchRequest::Update>;

// Two of a pass, a third of it apart.
Placed PickTwo(const std::vector<UploadRequest>& pass) {
  const UploadRequest& first = pass[pass.size() / 3];
  const UploadRequest& second = pass[2 * pass.size() / 3];
  return {{first.key, first.pose}, {second.key, second.pose}};
}

// There and back: the time of the first correction, in which the pass is touched for the first
// time, and the median of the later ones; milliseconds of CPU.
Result<std::pair<double, double>> CorrectThem(AtlasAtWork& atlas, const Placed& placed) {
  constexpr int kTimes = 6;
  std::vector<double> cpu_ms;
  for (int time = 0; time < kTimes; ++time) {
    PoseBatchRequest batch;
    batch.author = "passes_bench";
    batch.updates = placed;
    for (auto& update : batch.updates) {
      update.pose.x_um += time % 2 == 0 ? 300'000 : 0;
    }
    const auto cost = atlas.UpdatePoses(std::move(batch));
    if (!cost) return Error(cost.error());
    cpu_ms.push_back(cost->cpu_ms);
  }
  const double first_ms = cpu_ms.front();
  return std::pair(first_ms, Quantile({cpu_ms.begin() + 1, cpu_ms.end()}, 0.5));
}

// One JSON line.
Status PrintCorrections(AtlasAtWork& atlas,
                        int pass,
                        const MapProfile& profile,
                        const Placed& oldest,
                        const Placed& latest) {
  const auto of_oldest = CorrectThem(atlas, oldest);
  if (!of_oldest) return of_oldest.error();
  const auto of_latest = CorrectThem(atlas, latest);
  if (!of_latest) return of_latest.error();
  std::cout << "{\"corrected_after_pass\": " << pass << ", \"preset\": \""
            << FusionPresetName(profile.preset) << "\", \"oldest_first_ms\": " << of_oldest->first
            << ", \"oldest_ms\": " << of_oldest->second
            << ", \"latest_first_ms\": " << of_latest->first
            << ", \"latest_ms\": " << of_latest->second << "}" << std::endl;
  return {};
}

// What is stored and kept.
struct BytesInUse {
  std::uint64_t database = 0;
  std::uint64_t keyframes = 0;  // of it
  std::uint64_t tiles = 0;      // of it
  std::uint64_t kept = 0;       // surveys in memory

  static Result<BytesInUse> Of(AtlasAtWork& atlas) {
    const auto status = atlas.service().ReadStatus();
    if (!status) return Error(status.error());
    return BytesInUse{atlas.DatabaseBytes(), status->counts.keyframe_bytes,
                      status->counts.tile_bytes, status->kept_bytes};
  }
};

// Tiles and surveys can get smaller, too.
std::int64_t Added(std::uint64_t before, std::uint64_t after) {
  return static_cast<std::int64_t>(after) - static_cast<std::int64_t>(before);
}

// One JSON line.
void PrintPass(int pass,
               FusionPreset preset,
               const std::vector<UpdateCost>& costs,
               const BytesInUse& before,
               const BytesInUse& after) {
  std::vector<double> wall_ms;
  double cpu_sum_ms = 0;
  std::uint64_t tiles = 0;
  for (const UpdateCost& cost : costs) {
    wall_ms.push_back(cost.wall_ms);
    cpu_sum_ms += cost.cpu_ms;
    tiles += cost.tiles;
  }
  const auto keyframes = static_cast<double>(costs.size());
  std::cout << "{\"pass\": " << pass << ", \"preset\": \"" << FusionPresetName(preset)
            << "\", \"keyframes\": " << costs.size()
            << ", \"tiles_per_keyframe\": " << static_cast<double>(tiles) / keyframes
            << ", \"cpu_ms\": " << cpu_sum_ms / keyframes
            << ", \"cpu_ms_first\": " << costs.front().cpu_ms
            << ", \"wall_ms_first\": " << wall_ms.front()
            << ", \"wall_ms_p50\": " << Quantile(wall_ms, 0.5)
            << ", \"wall_ms_p99\": " << Quantile(wall_ms, 0.99)
            << ", \"kept_bytes\": " << after.kept
            << ", \"database_bytes_added\": " << Added(before.database, after.database)
            << ", \"keyframe_bytes_added\": " << Added(before.keyframes, after.keyframes)
            << ", \"tile_bytes_added\": " << Added(before.tiles, after.tiles)
            << ", \"kept_bytes_added\": " << Added(before.kept, after.kept) << "}" << std::endl;
}

Result<Placed> RunPass(
    AtlasAtWork& atlas, WorldKind world, int pass, int vehicles, const MapProfile& profile) {
  auto requests = DrivePass(world, pass, vehicles, profile);
  if (!requests) return Error(requests.error());
  Placed two = PickTwo(*requests);
  const auto before = BytesInUse::Of(atlas);
  if (!before) return Error(before.error());
  std::vector<UpdateCost> costs;
  for (UploadRequest& request : *requests) {
    const auto cost = atlas.Upload(std::move(request));
    if (!cost) return Error(cost.error());
    costs.push_back(*cost);
  }
  const auto after = BytesInUse::Of(atlas);
  if (!after) return Error(after.error());
  PrintPass(pass, profile.preset, costs, *before, *after);
  return two;
}

int Run(const std::string& world_name,
        const std::string& preset_name,
        int passes,
        int vehicles,
        const std::string& mode) {
  const auto world = WorldKindByName(world_name);
  const auto preset = FusionPresetByName(preset_name);
  const bool corrects = mode == "correct";
  const bool is_cold = mode == "restart-cold";
  const bool restarts = mode == "restart" || is_cold;
  if (!world || !preset || passes < 1 || vehicles < 1 ||
      (!mode.empty() && !corrects && !restarts)) {
    std::cerr << "usage: passes_bench street|overpass|garage strict|bounded|paper PASSES "
                 "[VEHICLES [correct|restart|restart-cold]]\n";
    return 2;
  }
  MapProfile profile;
  profile.preset = *preset;
  FusionOptions fusion;
  if (is_cold) {
    fusion.building.survey_files.max_bytes = 0;
  }
  AtlasAtWork atlas(profile, fusion);
  Placed oldest;
  for (int pass = 1; pass <= passes; ++pass) {
    if (restarts) {
      atlas.Restart();
    }
    const auto latest = RunPass(atlas, *world, pass, vehicles, profile);
    Status status = latest ? Status() : latest.error();
    if (pass == 1 && latest) {
      oldest = *latest;
    }
    if (corrects && latest) {
      status = PrintCorrections(atlas, pass, profile, oldest, *latest);
    }
    if (!status.ok()) {
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
  if (arguments.size() < 3) {
    return atlas::testing::Run("", "", 0, 0, "");
  }
  const int vehicles = arguments.size() > 3 ? std::atoi(arguments[3].c_str()) : 1;
  return atlas::testing::Run(arguments[0], arguments[1], std::atoi(arguments[2].c_str()), vehicles,
                             arguments.size() > 4 ? arguments[4] : "");
}
