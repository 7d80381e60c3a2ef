// A vehicle's keyframes, brought to the daemon over a link that fails, however long that takes.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "client/vehicle/atlas_link.h"
#include "tests/client/ledger/fleet_frames.h"

namespace atlas::testing {

struct UploadLoad {
  Endpoint endpoint;
  int vehicle = 0;
  std::vector<FrameId> frames;  // in the order in which they are sent
  std::chrono::seconds patience{60};
};

struct UploadCount {
  std::uint64_t sent = 0;        // again and again, too
  std::uint64_t duplicates = 0;  // of these, answered so
};

// For links of tests: it comes back within hundredths of a second, and gives up a silent daemon
// before a stall is over.
LinkOptions HastyLink(const Endpoint& endpoint);

// Each ends when all are acknowledged. Errors: a refusal, or the link's last failure when the
// patience ends.
Result<UploadCount> UploadDirectly(const UploadLoad& load);
// Goes on behind what the handshake says is there: frames by rising session and sequence.
Result<UploadCount> UploadResuming(const UploadLoad& load);
Result<UploadCount> UploadThroughSpool(const UploadLoad& load, const std::filesystem::path& folder);

}  // namespace atlas::testing
