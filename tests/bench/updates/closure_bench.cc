// What a loop closure costs: 500 keyframes corrected by 0.1 to 1 m in one batch, against building
// the tiles that it touches from nothing, in the faster of two ways; one JSON line a case.
//   all_moved: a drive of 500 keyframes, every one of them corrected
//   one_pass_of_four: the same way driven four times, the last pass corrected
//   drive: in the middle of the whole drive, while a vehicle uploads and others ask for the map
// Usage: closure_bench [--cache-mib N] TRAJECTORY [CASE ...]
// --cache-mib: the daemon's setting of that name; the plain build has what it needs in any case.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <iterator>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "core/fusion/observation/keyframe_placement.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/scan/drive_folder.h"
#include "core/simulation/city/city_world.h"
#include "tests/bench/updates/atlas_at_work.h"
#include "tests/bench/updates/drive_uploads.h"
#include "tests/bench/updates/map_traffic.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kCorrected = 500;
constexpr double kEvery_m = 0.7;  // at least: 3723 keyframes of the 3.7 km of KITTI's drive 00
constexpr double kTurn = 0.02;    // rad from one corrected keyframe to the next: a smooth bend

// A keyframe's level-0 tiles at a pose.
std::vector<TileId> TilesOf(const UploadRequest& upload,
                            const QuantizedPose& pose,
                            const MapProfile& profile) {
  const Keyframe keyframe = DecodeKeyframe(upload.blob).value();
  const KeyframePlacement placement = PlaceKeyframe(pose, keyframe.level_quaternion).value();
  return FootprintTiles(placement, keyframe.grid, profile);
}

// Keyframes as uploaded, those of [begin, begin + 500) to be corrected: by 0.1 m at first, 1 m at
// last, in a direction that turns.
struct Correction {
  PoseBatchRequest batch;
  std::set<TileId> tiles;  // old and new footprints, and all above them
};

Correction Correct(const std::vector<UploadRequest>& uploads,
                   std::size_t begin,
                   const MapProfile& profile) {
  Correction correction;
  correction.batch.author = "closure_bench";
  for (std::size_t i = 0; i < kCorrected; ++i) {
    const UploadRequest& upload = uploads[begin + i];
    const double share = static_cast<double>(i) / static_cast<double>(kCorrected - 1);
    const double length_um = 1e6 * (0.1 + 0.9 * share);
    const double angle_rad = kTurn * static_cast<double>(i);
    QuantizedPose pose = upload.pose;
    pose.x_um += std::llround(length_um * std::cos(angle_rad));
    pose.y_um += std::llround(length_um * std::sin(angle_rad));
    correction.batch.updates.push_back({upload.key, pose});
    for (const QuantizedPose& place : {upload.pose, pose}) {
      for (TileId id : TilesOf(upload, place, profile)) {
        correction.tiles.insert(id);
        for (; id.level + 1 < profile.levels; id = id.Parent()) {
          correction.tiles.insert(id.Parent());
        }
      }
    }
  }
  return correction;
}

std::uint64_t CountLevel0(const std::set<TileId>& tiles) {
  return static_cast<std::uint64_t>(
      std::count_if(tiles.begin(), tiles.end(), [](const TileId& id) { return id.level == 0; }));
}

// The same tiles from nothing: as the service does after a restart, with surveys for the next time,
// and plainly.
struct ColdBuilds {
  UpdateCost service;
  UpdateCost batch;
};

Result<ColdBuilds> BuildFromNothing(AtlasAtWork& atlas, const std::set<TileId>& tiles) {
  const auto service = atlas.BuildCold({tiles.begin(), tiles.end()});
  if (!service) return Error(service.error());
  const auto batch = atlas.BuildBatch(tiles);
  if (!batch) return Error(batch.error());
  return ColdBuilds{*service, *batch};
}

void Print(const std::string& name,
           std::size_t keyframes,
           const Correction& correction,
           const UpdateCost& cost,
           const ColdBuilds& cold,
           const std::string& more = "") {
  const double cold_cpu_ms = std::min(cold.service.cpu_ms, cold.batch.cpu_ms);
  std::cout << "{\"case\": \"" << name << "\", \"keyframes\": " << keyframes
            << ", \"tiles_expected\": " << CountLevel0(correction.tiles)
            << ", \"tiles_marked\": " << cost.tiles
            << ", \"with_ancestors\": " << correction.tiles.size() << ", \"built\": " << cost.built
            << ", \"cpu_s\": " << 1e-3 * cost.cpu_ms << ", \"wall_s\": " << 1e-3 * cost.wall_ms
            << ", \"cold_built\": " << cold.service.built
            << ", \"cold_cpu_s\": " << 1e-3 * cold.service.cpu_ms
            << ", \"cold_wall_s\": " << 1e-3 * cold.service.wall_ms
            << ", \"batch_built\": " << cold.batch.built
            << ", \"batch_cpu_s\": " << 1e-3 * cold.batch.cpu_ms
            << ", \"cpu_ratio\": " << cost.cpu_ms / cold_cpu_ms << more << "}" << std::endl;
}

Status MeasureCase(const std::string& name,
                   std::vector<UploadRequest> uploads,
                   const MapProfile& profile,
                   const FusionOptions& fusion) {
  const Correction correction = Correct(uploads, uploads.size() - kCorrected, profile);
  const std::size_t keyframes = uploads.size();
  AtlasAtWork atlas(profile, fusion);
  const auto filled = atlas.UploadAll(std::move(uploads));
  if (!filled) return filled.error();
  const auto cost = atlas.UpdatePoses(correction.batch);
  if (!cost) return cost.error();
  const auto cold = BuildFromNothing(atlas, correction.tiles);
  if (!cold) return cold.error();
  Print(name, keyframes, correction, *cost, *cold);
  return {};
}

Status MeasureDrive(std::vector<UploadRequest> uploads,
                    std::vector<UploadRequest> others,
                    const MapProfile& profile,
                    const FusionOptions& fusion) {
  const std::size_t keyframes = uploads.size();
  const Correction correction = Correct(uploads, keyframes / 2, profile);
  AtlasAtWork atlas(profile, fusion);
  const auto filled = atlas.UploadAll(std::move(uploads));
  if (!filled) return filled.error();
  MapTraffic traffic(atlas.service(), std::move(others));
  const auto cost = atlas.UpdatePoses(correction.batch);
  if (!cost) return cost.error();
  traffic.Stop();
  const auto cold = BuildFromNothing(atlas, correction.tiles);
  if (!cold) return cold.error();
  Print("drive", keyframes, correction, *cost, *cold,
        StrCat(", \"fill_s\": ", 1e-3 * filled->wall_ms, traffic.Report()));
  return {};
}

Status Run(const std::string& path,
           const std::set<std::string>& cases,
           const FusionOptions& fusion) {
  const auto is_asked = [&](const char* name) {
    return cases.empty() || cases.contains(name);
  };
  const auto poses = ReadPoses(path);
  if (!poses) return poses.error();
  const auto trajectory = PlanTrajectory(*poses, {.every_m = kEvery_m});
  if (!trajectory) return trajectory.error();
  const MapProfile profile;
  const auto drive_uploads = [&](int pass, std::size_t end) -> Result<std::vector<UploadRequest>> {
    DriveOptions options;
    options.seed = 2 * static_cast<std::uint64_t>(pass);
    const auto drive = DriveCity(*trajectory, options);
    if (!drive) return Error(drive.error());
    UploadOptions upload;
    upload.session = StrCat("pass.", pass);
    upload.start_ms = 3'600'000 * pass;
    upload.end = end;
    return MakeUploads(*drive, profile, upload);
  };
  if (is_asked("all_moved")) {
    auto uploads = drive_uploads(0, kCorrected);
    if (!uploads) return uploads.error();
    ATLAS_RETURN_IF_ERROR(MeasureCase("all_moved", *std::move(uploads), profile, fusion));
  }
  if (is_asked("one_pass_of_four")) {
    std::vector<UploadRequest> four;
    for (int pass = 0; pass < 4; ++pass) {
      auto uploads = drive_uploads(pass, kCorrected);
      if (!uploads) return uploads.error();
      std::move(uploads->begin(), uploads->end(), std::back_inserter(four));
    }
    ATLAS_RETURN_IF_ERROR(MeasureCase("one_pass_of_four", std::move(four), profile, fusion));
  }
  if (is_asked("drive")) {
    auto uploads = drive_uploads(0, SIZE_MAX);
    if (!uploads) return uploads.error();
    auto others = drive_uploads(3, kCorrected);
    if (!others) return others.error();
    ATLAS_RETURN_IF_ERROR(MeasureDrive(*std::move(uploads), *std::move(others), profile, fusion));
  }
  return {};
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  atlas::FusionOptions fusion;
  if (arguments.size() > 1 && arguments[0] == "--cache-mib") {
    fusion.building.keyframe_bytes = std::stoul(arguments[1]) << 20;
    arguments.erase(arguments.begin(), arguments.begin() + 2);
  }
  if (arguments.empty()) {
    std::cerr << "usage: closure_bench [--cache-mib N] TRAJECTORY [all_moved] [one_pass_of_four] "
                 "[drive]\n";
    return 2;
  }
  const std::set<std::string> cases(arguments.begin() + 1, arguments.end());
  const atlas::Status status = atlas::testing::Run(arguments[0], cases, fusion);
  if (!status.ok()) {
    std::cerr << "closure_bench: " << status.message() << "\n";
    return 1;
  }
  return 0;
}
