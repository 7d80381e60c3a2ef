// Sessions of one atlas brought to a daemon, staged, as they are: to be merged there.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "client/connection/atlas_client.h"
#include "client/merge/source/session_selection.h"
#include "client/merge/source/session_source.h"
#include "core/base/status.h"

namespace atlas {

// Empty: it is brought. It is not where it is quarantined, retracted or damaged.
std::string WhyNotBrought(const SessionSummary& session);

// kInvalidArgument: an atlas of that profile can take no keyframe of this source.
Status CheckTransfer(const SessionSource& from, const MapProfile& to);

struct TransferReport {
  std::size_t sessions = 0;
  std::size_t keyframes = 0;
  std::size_t duplicates = 0;     // of them were there already
  std::vector<LeftOut> left_out;  // sessions and keyframes, and why
};

// Those in the map of `from` and those staged there, as WhyNotBrought says. Each keyframe with the
// pose that it has there, under the name that it has there; a session that the daemon has already
// stays in the state that it is in. Ended at any point, what came is staged, and the next time it
// is there already. kInvalidArgument: the atlases have other map profiles. kConflict: the daemon
// has other keyframes under these names. Else errors are those of both and of `progress`, which is
// told of keyframes.
Result<TransferReport> TransferSessions(
    SessionSource& from,
    AtlasClient& to,
    const std::function<Status(std::size_t done, std::size_t all)>& progress);

}  // namespace atlas
