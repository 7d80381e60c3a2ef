// Vehicles that upload keyframes side by side, each with a connection and a thread of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "core/base/status.h"
#include "tests/bench/serving/stored_uploads.h"
#include "tests/bench/serving/upload_figures.h"

namespace atlas::testing {

struct FleetOptions {
  std::uint16_t port = 0;
  std::size_t vehicles = 1;
  double per_s = 0.0;         // keyframes of each; 0: as fast as the daemon takes them
  std::size_t keyframes = 1;  // of each
  std::string session;        // under which none of them uploaded yet
};

// `on_ready` is called once, when all are connected and before anything is sent. Each vehicle
// begins at another of the keyframes, which it goes through in turn. Any refusal, any duplicate is
// an error.
Result<UploadFigures> RunFleet(std::span<const StoredUpload> uploads,
                               const FleetOptions& options,
                               const std::function<void()>& on_ready);

}  // namespace atlas::testing
