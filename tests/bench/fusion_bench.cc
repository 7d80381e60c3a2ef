// Fusion of one tile, pyramid and codecs on street-like keyframes: cell-observations a second and
// milliseconds on one thread.
#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>

#include "core/fusion/tile_fusion.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_pyramid.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {
namespace {

constexpr std::int32_t kRadiusCells = 200;

// One keyframe a metre along a slightly winding drive; every fourth pass another session.
std::vector<PlacedKeyframe> Drive(const MapProfile& profile, int count, bool with_columns) {
  std::vector<PlacedKeyframe> keyframes;
  for (int i = 0; i < count; ++i) {
    Keyframe keyframe = StreetKeyframe(profile, kRadiusCells, static_cast<std::uint32_t>(i));
    if (!with_columns) {
      keyframe.columns.assign(keyframe.columns.size(), 0);
    }
    const FrameName name{"car", "drive" + std::to_string(i / 32), static_cast<std::uint32_t>(i)};
    const MapPose pose{1.0 * (i % 32) - 9.3, 6.1 + 0.05 * (i % 7), 0.01 * i, 3.0 * (i % 11)};
    keyframes.push_back(PlacedFrame(name, pose, std::move(keyframe)));
  }
  return keyframes;
}

// Observations are counted from the result: each keyframe counts once in a cell's layer.
std::int64_t CountObservations(const Tile& tile) {
  std::int64_t count = 0;
  for (const TileLayer& layer : tile.layers) {
    count += layer.observations;
  }
  return count;
}

void BM_FuseTile(benchmark::State& state) {
  const MapProfile profile;
  const auto keyframes = Drive(profile, static_cast<int>(state.range(0)), state.range(1) != 0);
  std::int64_t observations = 0;
  for (auto _ : state) {
    const Tile tile = FuseTile({0, 0, 0}, keyframes, profile);
    observations += CountObservations(tile);
  }
  state.counters["cell_observations/s"] =
      benchmark::Counter(static_cast<double>(observations), benchmark::Counter::kIsRate);
}
BENCHMARK(BM_FuseTile)
    ->ArgNames({"keyframes", "columns"})
    ->Args({8, 1})
    ->Args({32, 0})
    ->Args({32, 1})
    ->Args({128, 0})
    ->Args({128, 1})
    ->Args({512, 1})
    ->Unit(benchmark::kMillisecond);

void BM_EncodeKeyframe(benchmark::State& state) {
  const Keyframe keyframe = StreetKeyframe(MapProfile(), kRadiusCells, 1);
  std::size_t size = 0;
  for (auto _ : state) {
    size = EncodeKeyframe(keyframe).size();
  }
  state.counters["bytes"] = static_cast<double>(size);
}
BENCHMARK(BM_EncodeKeyframe)->Unit(benchmark::kMillisecond);

void BM_DecodeKeyframe(benchmark::State& state) {
  const Bytes blob = EncodeKeyframe(StreetKeyframe(MapProfile(), kRadiusCells, 1));
  for (auto _ : state) {
    benchmark::DoNotOptimize(DecodeKeyframe(blob));
  }
}
BENCHMARK(BM_DecodeKeyframe)->Unit(benchmark::kMillisecond);

void BM_EncodeTile(benchmark::State& state) {
  const MapProfile profile;
  const Tile tile = FuseTile({0, 0, 0}, Drive(profile, 32, true), profile);
  std::size_t size = 0;
  for (auto _ : state) {
    size = EncodeTile(tile, profile).blob.size();
  }
  state.counters["bytes"] = static_cast<double>(size);
}
BENCHMARK(BM_EncodeTile)->Unit(benchmark::kMillisecond);

void BM_DecodeTile(benchmark::State& state) {
  const MapProfile profile;
  const Tile tile = FuseTile({0, 0, 0}, Drive(profile, 32, true), profile);
  const Bytes blob = EncodeTile(tile, profile).blob;
  for (auto _ : state) {
    benchmark::DoNotOptimize(DecodeTile(blob, profile));
  }
}
BENCHMARK(BM_DecodeTile)->Unit(benchmark::kMillisecond);

void BM_BuildParentTile(benchmark::State& state) {
  const MapProfile profile;
  const Tile tile = FuseTile({0, 0, 0}, Drive(profile, 32, true), profile);
  for (auto _ : state) {
    benchmark::DoNotOptimize(BuildParentTile({1, 0, 0}, {&tile, &tile, &tile, &tile}, profile));
  }
}
BENCHMARK(BM_BuildParentTile)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace atlas::testing

BENCHMARK_MAIN();
