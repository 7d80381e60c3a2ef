// How fast tiles are made on one core, by observations of cells: by the plain oracle, by a fusion
// from nothing, and from what was kept of the last time. The three take turns on the same tiles;
// one JSON line a drive.
// Usage: speed_bench street|overpass|garage|FOLDER ...
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "core/base/str_cat.h"
#include "core/fusion/observation/frame_resampler.h"
#include "core/fusion/tile_surveys.h"
#include "tests/bench/accuracy/bench_drive.h"
#include "tests/bench/accuracy/drive_map.h"
#include "tests/bench/updates/quantile.h"
#include "tests/bench/updates/recorded_keyframes.h"
#include "tests/core/fusion/oracle/plain_fusion.h"

namespace atlas::testing {
namespace {

constexpr int kRuns = 5;

double CpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

template <typename Work>
double Measure(const Work& work) {
  const double begin_s = CpuSeconds();
  work();
  return CpuSeconds() - begin_s;
}

// A tile's keyframes, and what is kept of it.
struct TileAtWork {
  std::vector<PlacedKeyframe> keyframes;
  std::vector<FrameOnMap> frames;
  TileSurveys surveys;
};

class SpeedBench {
 public:
  explicit SpeedBench(const std::vector<PlacedKeyframe>& keyframes)
      : sigmas_(profile_, Keyframe::kMaxRadiusCells) {
    for (const PlacedKeyframe& placed : keyframes) {
      for (const TileId& id : FootprintTiles(placed.placement, placed.keyframe->grid, profile_)) {
        TileAtWork& tile =
            tiles_.try_emplace(id, TileAtWork{{}, {}, TileSurveys(id)}).first->second;
        tile.frames.push_back({placed.key, placed.time_ms, placed.placement, placed.keyframe->grid,
                               tile.frames.size()});
        tile.keyframes.push_back(placed);
      }
    }
    for (const auto& [id, tile] : tiles_) {
      CountObservations(id, tile);
    }
  }

  // Throws away what is kept, and makes it anew.
  void FuseCold() {
    surveys_bytes_ = 0;
    for (auto& [id, tile] : tiles_) {
      tile.surveys = TileSurveys(id);
      Refresh(tile, {tile.frames, {}});
      surveys_bytes_ = std::max(surveys_bytes_, tile.surveys.bytes());
    }
  }
  void FuseBatch() {
    for (const auto& [id, tile] : tiles_) {
      cells_ += FuseTile(id, tile.keyframes, profile_).layers.size();
    }
  }
  void FusePlainly() {
    for (const auto& [id, tile] : tiles_) {
      cells_ += PlainFuseTile(id, tile.keyframes, profile_).layers.size();
    }
  }
  // From the kept surveys alone, every cell; what forgets the tiles is not timed.
  double CombineKept() {
    for (auto& [id, tile] : tiles_) {
      tile.surveys.Pack();
      tile.surveys.Unpack();
    }
    return Measure([&] {
      for (auto& [id, tile] : tiles_) {
        Refresh(tile, {});
      }
    });
  }

  std::uint64_t observations() const { return observations_; }
  std::size_t tiles() const { return tiles_.size(); }
  std::size_t surveys_bytes() const { return surveys_bytes_; }

 private:
  void CountObservations(const TileId& id, const TileAtWork& tile) {
    for (std::size_t i = 0; i < tile.frames.size(); ++i) {
      FrameResampler(tile.frames[i], *tile.keyframes[i].keyframe, sigmas_, profile_)
          .Visit(
              {id, 0, profile_.tile_cells}, [](std::size_t) {},
              [&](std::size_t, const Observation&) { ++observations_; });
    }
  }
  void Refresh(TileAtWork& tile, const TileChange& change) {
    for (const FrameOnMap& frame : tile.surveys.Expect(change, {profile_, sigmas_})) {
      tile.surveys.Add(frame, *tile.keyframes[frame.content].keyframe, {profile_, sigmas_});
    }
    cells_ += tile.surveys.Combine({profile_, sigmas_}).layers.size();
  }

  MapProfile profile_;
  SigmaTable sigmas_;
  std::map<TileId, TileAtWork> tiles_;
  std::uint64_t observations_ = 0;
  std::size_t surveys_bytes_ = 0;  // of the largest tile
  std::size_t cells_ = 0;          // so that nothing is left out
};

Result<std::vector<PlacedKeyframe>> KeyframesOf(const std::string& name) {
  const MapProfile profile;
  if (std::filesystem::is_directory(name)) {
    return ReadKeyframes(name, profile);
  }
  const auto drive = MakeBenchDrive(name, {});
  if (!drive) return Error(drive.error());
  return BuildKeyframes(*drive, 0, drive->scans(), profile, 20.0);
}

Status Run(const std::string& name) {
  const auto keyframes = KeyframesOf(name);
  if (!keyframes) return keyframes.error();
  SpeedBench bench(*keyframes);
  std::vector<double> plain_s, batch_s, cold_s, kept_s;
  for (int run = 0; run < kRuns; ++run) {
    plain_s.push_back(Measure([&] { bench.FusePlainly(); }));
    batch_s.push_back(Measure([&] { bench.FuseBatch(); }));
    cold_s.push_back(Measure([&] { bench.FuseCold(); }));
    kept_s.push_back(bench.CombineKept());
  }
  const auto millions = static_cast<double>(bench.observations()) * 1e-6;
  std::cout << "{\"drive\": \"" << std::filesystem::path(name).filename().string()
            << "\", \"keyframes\": " << keyframes->size() << ", \"tiles\": " << bench.tiles()
            << ", \"observations\": " << bench.observations()
            << ", \"plain_M_per_s\": " << millions / Quantile(plain_s, 0.5)
            << ", \"batch_M_per_s\": " << millions / Quantile(batch_s, 0.5)
            << ", \"cold_M_per_s\": " << millions / Quantile(cold_s, 0.5)
            << ", \"kept_M_per_s\": " << millions / Quantile(kept_s, 0.5)
            << ", \"surveys_bytes\": " << bench.surveys_bytes() << "}" << std::endl;
  return {};
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: speed_bench street|overpass|garage|FOLDER ...\n";
    return 2;
  }
  for (int i = 1; i < argc; ++i) {
    if (const atlas::Status status = atlas::testing::Run(argv[i]); !status.ok()) {
      std::cerr << argv[i] << ": " << status.message() << "\n";
      return 1;
    }
  }
  return 0;
}
