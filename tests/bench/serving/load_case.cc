#include "tests/bench/serving/load_case.h"

#include <algorithm>
#include <iostream>
#include <iterator>
#include <vector>

#include "core/base/str_cat.h"

namespace atlas::testing {
namespace {

float QuantileOf(std::vector<float>& values, double q) {
  if (values.empty()) {
    return 0.0F;
  }
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

const LoadCase* FindLoadCase(const std::string& name) {
  const auto* const found =
      std::find_if(std::begin(kLoadCases), std::end(kLoadCases),
                   [&name](const LoadCase& candidate) { return candidate.name == name; });
  return found == std::end(kLoadCases) ? nullptr : found;
}

Status RunCase(const LoadServer& server,
               const LoadCase& run,
               std::span<const LoadTile> tiles,
               int round,
               LoadOptions options) {
  options.mode = run.mode;
  options.tiles_per_batch = run.tiles_per_batch;
  options.seed = static_cast<std::uint64_t>(round + 1);
  auto result = RunLoad(server.protocol, tiles, options);
  if (!result) {
    return result.error().WithContext(StrCat(server.name, ", ", run.name));
  }
  if (result->batches == 0 || (result->tile_bytes > 0) != (run.mode == LoadMode::kFetch)) {
    return {StatusCode::kInvalidData, StrCat(server.name, ", ", run.name, ": ", result->batches,
                                             " batches, ", result->tile_bytes, " bytes of tiles")};
  }
  std::cout << "{\"case\": \"" << run.name << "\", \"server\": \"" << server.name
            << "\", \"round\": " << round
            << ", \"tiles_per_s\": " << static_cast<double>(result->tiles) / result->seconds
            << ", \"mib_per_s\": "
            << static_cast<double>(result->wire_bytes) / result->seconds / (1u << 20)
            << ", \"batch_ms_p50\": " << QuantileOf(result->batch_ms, 0.5)
            << ", \"batch_ms_p99\": " << QuantileOf(result->batch_ms, 0.99)
            << ", \"batch_ms_max\": " << QuantileOf(result->batch_ms, 1.0)
            << ", \"reads\": " << result->calls << ", \"batches\": " << result->batches << "}"
            << std::endl;
  return {};
}

}  // namespace atlas::testing
