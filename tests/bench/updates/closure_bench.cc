// What a loop closure costs: 500 keyframes corrected by 0.1 to 1 m in one batch, against building
// the tiles that it touches from nothing; one JSON line a case.
//   all_moved: a drive of 500 keyframes, every one of them corrected
//   one_pass_of_four: the same way driven four times, the last pass corrected
//   drive: in the middle of the whole drive, while a vehicle uploads and others ask for the map
// Usage: closure_bench TRAJECTORY [CASE ...]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <iostream>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/base/str_cat.h"
#include "core/fusion/observation/keyframe_placement.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/scan/drive_folder.h"
#include "core/simulation/city/city_world.h"
#include "server/store/await.h"
#include "tests/bench/updates/atlas_at_work.h"
#include "tests/bench/updates/drive_uploads.h"
#include "tests/bench/updates/quantile.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kCorrected = 500;
constexpr double kEvery_m = 0.7;  // at least: 3723 keyframes of the 3.7 km of KITTI's drive 00
constexpr double kTurn = 0.02;    // rad from one corrected keyframe to the next: a smooth bend

using Clock = std::chrono::steady_clock;

double MsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

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

void Print(const std::string& name,
           std::size_t keyframes,
           const Correction& correction,
           const UpdateCost& cost,
           const UpdateCost& cold,
           const std::string& more = "") {
  std::cout << "{\"case\": \"" << name << "\", \"keyframes\": " << keyframes
            << ", \"tiles_expected\": " << CountLevel0(correction.tiles)
            << ", \"tiles_marked\": " << cost.tiles
            << ", \"with_ancestors\": " << correction.tiles.size() << ", \"built\": " << cost.built
            << ", \"cpu_s\": " << 1e-3 * cost.cpu_ms << ", \"wall_s\": " << 1e-3 * cost.wall_ms
            << ", \"cold_built\": " << cold.built << ", \"cold_cpu_s\": " << 1e-3 * cold.cpu_ms
            << ", \"cold_wall_s\": " << 1e-3 * cold.wall_ms
            << ", \"cpu_ratio\": " << cost.cpu_ms / cold.cpu_ms
            << ", \"wall_ratio\": " << cost.wall_ms / cold.wall_ms << more << "}" << std::endl;
}

Status MeasureCase(const std::string& name,
                   std::vector<UploadRequest> uploads,
                   const MapProfile& profile) {
  const Correction correction = Correct(uploads, uploads.size() - kCorrected, profile);
  const std::size_t keyframes = uploads.size();
  AtlasAtWork atlas(profile, {});
  const auto filled = atlas.UploadAll(std::move(uploads));
  if (!filled) return filled.error();
  const auto cost = atlas.UpdatePoses(correction.batch);
  if (!cost) return cost.error();
  const auto cold = atlas.BuildCold({correction.tiles.begin(), correction.tiles.end()});
  if (!cold) return cold.error();
  Print(name, keyframes, correction, *cost, *cold);
  return {};
}

// Asks for the map here and there, and uploads a keyframe a second, until it is stopped.
class Traffic {
 public:
  Traffic(AtlasService& service, std::vector<UploadRequest> uploads)
      : service_(service),
        uploads_(std::move(uploads)),
        query_thread_([this] { Query(); }),
        upload_thread_([this] { Upload(); }) {}
  Traffic(const Traffic&) = delete;
  Traffic& operator=(const Traffic&) = delete;
  ~Traffic() { Stop(); }

  void Stop() {
    is_stopping_ = true;
    if (query_thread_.joinable()) query_thread_.join();
    if (upload_thread_.joinable()) upload_thread_.join();
  }
  // Once stopped.
  std::string Report() const {
    return StrCat(
        ", \"queries\": ", query_ms_.size(), ", \"query_ms_p50\": ", Quantile(query_ms_, 0.5),
        ", \"query_ms_p99\": ", Quantile(query_ms_, 0.99), ", \"uploads\": ", upload_ms_.size(),
        ", \"acknowledged_ms_p50\": ", Quantile(upload_ms_, 0.5),
        ", \"acknowledged_ms_max\": ", Quantile(upload_ms_, 1.0), ", \"failed\": ", failed_.load());
  }

 private:
  void Query() {
    for (std::size_t i = 0; !is_stopping_; i += 37) {
      const QuantizedPose& pose = uploads_[i % uploads_.size()].pose;
      RegionRequest request;
      request.disc = RegionDisc{pose.x_um, pose.y_um, 20'000'000};
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
  void Upload() {
    for (std::size_t i = 0; !is_stopping_ && i < uploads_.size(); ++i) {
      const auto begin = Clock::now();
      const auto result = Await<PutKeyframeResult>(
          [&](auto done) { service_.Upload(uploads_[i], std::move(done)); });
      failed_ += result ? 0 : 1;
      upload_ms_.push_back(MsSince(begin));
      std::this_thread::sleep_until(begin + std::chrono::seconds(1));
    }
  }

  AtlasService& service_;
  const std::vector<UploadRequest> uploads_;
  std::atomic<bool> is_stopping_ = false;
  std::atomic<int> failed_ = 0;
  std::vector<double> query_ms_;
  std::vector<double> upload_ms_;
  std::thread query_thread_;
  std::thread upload_thread_;
};

Status MeasureDrive(std::vector<UploadRequest> uploads,
                    std::vector<UploadRequest> others,
                    const MapProfile& profile) {
  const std::size_t keyframes = uploads.size();
  const Correction correction = Correct(uploads, keyframes / 2, profile);
  AtlasAtWork atlas(profile, {});
  const auto filled = atlas.UploadAll(std::move(uploads));
  if (!filled) return filled.error();
  Traffic traffic(atlas.service(), std::move(others));
  const auto cost = atlas.UpdatePoses(correction.batch);
  if (!cost) return cost.error();
  traffic.Stop();
  const auto cold = atlas.BuildCold({correction.tiles.begin(), correction.tiles.end()});
  if (!cold) return cold.error();
  Print("drive", keyframes, correction, *cost, *cold,
        StrCat(", \"fill_s\": ", 1e-3 * filled->wall_ms, traffic.Report()));
  return {};
}

Status Run(const std::string& path, const std::set<std::string>& cases) {
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
  std::vector<UploadRequest> four;
  for (int pass = 0; pass < 4; ++pass) {
    auto uploads = drive_uploads(pass, kCorrected);
    if (!uploads) return uploads.error();
    std::move(uploads->begin(), uploads->end(), std::back_inserter(four));
  }
  const std::vector<UploadRequest> first(four.begin(), four.begin() + kCorrected);
  const std::vector<UploadRequest> last(four.end() - kCorrected, four.end());
  if (is_asked("all_moved")) {
    ATLAS_RETURN_IF_ERROR(MeasureCase("all_moved", first, profile));
  }
  if (is_asked("one_pass_of_four")) {
    ATLAS_RETURN_IF_ERROR(MeasureCase("one_pass_of_four", std::move(four), profile));
  }
  if (!is_asked("drive")) {
    return {};
  }
  auto uploads = drive_uploads(0, SIZE_MAX);
  if (!uploads) return uploads.error();
  return MeasureDrive(*std::move(uploads), last, profile);
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: closure_bench TRAJECTORY [all_moved] [one_pass_of_four] [drive]\n";
    return 2;
  }
  const std::set<std::string> cases(argv + 2, argv + argc);
  if (const atlas::Status status = atlas::testing::Run(argv[1], cases); !status.ok()) {
    std::cerr << "closure_bench: " << status.message() << "\n";
    return 1;
  }
  return 0;
}
