// Sessions of one atlas brought to a daemon, staged, as they are: to be merged there.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "client/connection/atlas_client.h"
#include "client/merge/source/session_selection.h"
#include "client/merge/source/session_source.h"
#include "core/base/status.h"

namespace atlas {

// Empty: it is brought. It is not where it is quarantined, retracted or damaged.
std::string WhyNotBrought(const SessionSummary& session);

// kInvalidArgument: an atlas of that profile can take no keyframe of this source; in what they
// differ.
Status CheckTransfer(const SessionSource& from, const MapProfile& to);

struct TransferReport {
  std::size_t sessions = 0;
  std::size_t keyframes = 0;
  std::size_t duplicates = 0;     // of them were there already
  std::vector<LeftOut> left_out;  // sessions and keyframes, and why
};

// kConflict: what a session's name stands for in one source and in another are different keyframes.
Status NameIsTaken(const SessionKey& session, const std::string& source, const std::string& other);

// To one daemon from one source after the other.
class SessionTransfer {
 public:
  // `to` outlives it, and is called `to_name` for people.
  SessionTransfer(AtlasClient& to, std::string to_name) : to_(to), to_name_(std::move(to_name)) {}

  // Those in the map of `from` and those staged there, as WhyNotBrought says. Each keyframe with
  // the pose that it has there, under the name that it has there; a session that the daemon has
  // already stays in the state that it is in. Ended at any point, what came is staged, and the next
  // time it is there already. kInvalidArgument: the atlases have other map profiles. kConflict:
  // NameIsTaken, by what was brought before or was there. Else errors are those of both and of
  // `progress`, which is told of keyframes.
  Result<TransferReport> Bring(
      SessionSource& from,
      const std::function<Status(std::size_t done, std::size_t all)>& progress);

 private:
  // Whose keyframes the daemon has under this name.
  const std::string& HolderOf(const SessionKey& session) const;

  AtlasClient& to_;
  std::string to_name_;
  std::map<SessionKey, std::string> brought_from_;  // the first source of each
};

}  // namespace atlas
