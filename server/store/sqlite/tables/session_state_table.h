// Table session_states: every state that each session was ever in, from its first keyframe on.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/store/session_types.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

struct SessionStateRow {
  std::int64_t session_id = 0;
  std::uint64_t revision = 0;
  SessionState state = SessionState::kLive;
  std::string author;
  std::string reason;
};

void WriteSessionState(Connection& connection, const SessionStateRow& row);

// kInvalidData when the line that tells is damaged or missing.
Result<SessionState> ReadSessionStateAt(Connection& connection,
                                        std::int64_t session_id,
                                        std::uint64_t revision);
// The first line behind a revision; nullopt: it is in the state that it was in then. kInvalidData:
// it is damaged.
Result<std::optional<SessionStateRow>> FindStateAfter(Connection& connection,
                                                      std::int64_t session_id,
                                                      std::uint64_t revision);
// The revision of the last line, as it says it, damaged or not.
std::uint64_t LastStateChange(Connection& connection, std::int64_t session_id);
// The sessions that entered a state at a revision, by their ids: reads all lines, and believes
// them.
std::vector<std::int64_t> ListSessionsChangedAt(Connection& connection, std::uint64_t revision);
// Why it is in the state it is in, if somebody said; of one that was retracted from quarantine, why
// it had been there, too.
Result<std::string> ReadStateReason(Connection& connection, std::int64_t session_id);
// What a retracted session was before.
Result<SessionState> ReadStateBeforeRetraction(Connection& connection, std::int64_t session_id);
// kInvalidData when a line is damaged or the last is not the current state.
Status CheckSessionStates(Connection& connection, std::int64_t session_id, SessionState current);
// Of lines whose checksum is wrong: the numbers of their rows.
std::vector<std::int64_t> ListDamagedSessionStates(Connection& connection);
// Whether the line of that row would be intact under another key.
bool IsSessionStateUnder(Connection& connection,
                         std::int64_t id,
                         std::int64_t session_id,
                         std::int64_t revision);
void DeleteSessionStates(Connection& connection, std::int64_t session_id);

}  // namespace atlas
