// How much was written, and how fast.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace atlas::testing {

struct UploadFigures {
  std::size_t keyframes = 0;  // that are on disk
  std::uint64_t bytes = 0;    // of their blobs
  double seconds = 0.0;
  std::vector<double> acknowledged_ms;  // each, where each was waited for
  std::vector<double> map_age_s;        // meanwhile, where that was asked for
};

}  // namespace atlas::testing
