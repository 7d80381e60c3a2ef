// Which state a session is in because of what its keyframes look like: quarantined when a way of at
// most kMostJudgedSteps from one to another, in sequence, is implausible (plausibility.h) at the
// poses that they were uploaded with. That is a matter of which keyframes are there, not of the
// order in which they came. Nobody judges over a gap that a compaction left, nor where a row is
// damaged.
#pragma once

#include <optional>
#include <string>

#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/store_types.h"

namespace atlas {

// By all of its keyframes: live or quarantined.
SessionJudgement JudgeSession(Connection& connection,
                              const SessionRow& session,
                              const PlausibilityLimits& limits);

// What a session is that comes into the map: judged, where there is something to judge it by, else
// `unjudged`. `reason`: why it comes, unless it is quarantined.
SessionJudgement JudgeEntering(Connection& connection,
                               const SessionRow& session,
                               SessionState unjudged,
                               const std::optional<PlausibilityLimits>& limits,
                               const std::string& reason);

// What a keyframe that was just added makes of its session; nullopt: it stays what it is. Looks at
// kMostJudgedSteps neighbours on each side alone, as a rule. Only live and quarantined sessions are
// judged.
std::optional<SessionJudgement> JudgeArrival(Connection& connection,
                                             const SessionRow& session,
                                             const NewKeyframe& keyframe);

}  // namespace atlas
