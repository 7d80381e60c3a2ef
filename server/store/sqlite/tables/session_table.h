// Table sessions: what each drive of a vehicle has contributed.
#pragma once

#include <optional>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

struct SessionRow {
  std::int64_t id = 0;
  SessionRecord record;
};

// nullopt: unknown. kInvalidData: its row is damaged.
Result<std::optional<SessionRow>> FindSession(Connection& connection, const SessionKey& key);
// Up to `limit` of those behind `after`, by vehicle and session; the first one of its vehicle
// alone. kInvalidData: a row is damaged, or their index. Who lists them all is told which rows are.
Result<std::vector<SessionRow>> ReadVehicleSessions(Connection& connection,
                                                    const SessionKey& after,
                                                    std::uint32_t limit);
Result<std::vector<SessionRecord>> ReadSessions(Connection& connection,
                                                const SessionKey& after,
                                                std::uint32_t limit);
Result<SessionRow> ReadSession(Connection& connection, std::int64_t id);
// kInvalidData when its row, a line of its history or a tombstone of its keyframes is damaged.
Status CheckSessionHistory(Connection& connection, const SessionKey& key);

// How many are in quarantine.
std::uint64_t CountQuarantined(Connection& connection);
// Ids of those whose rows are damaged.
std::vector<std::int64_t> ListDamagedSessions(Connection& connection);
// Whether the row would be intact with another id.
bool IsSessionRowOf(Connection& connection, std::int64_t id, std::int64_t other);
// What the row was, from the index of names, the history of states and the keyframes. kInvalidData
// when the history does not tell, or the row's checksum speaks against it, unless that is not to
// count any more.
enum class Vouching { kByChecksum, kByNobody };
Result<SessionRow> TellSession(Connection& connection, std::int64_t id, Vouching vouching);
// Writes it anew.
Status RestoreSession(Connection& connection, std::int64_t id, Vouching vouching);
// The same of one whose name is known.
Result<SessionRow> TellNamedSession(Connection& connection,
                                    std::int64_t id,
                                    const SessionKey& name,
                                    Vouching vouching);
// What the index of names and the row itself, damaged or not, call it. Nothing: no name.
std::optional<SessionKey> NameByIndex(Connection& connection, std::int64_t id);
std::optional<SessionKey> NameByRow(Connection& connection, std::int64_t id);
// By the rows.
bool IsNameOfAnother(Connection& connection, const SessionKey& key, std::int64_t id);
// Writes damaged rows anew. SQLite throws where an index has something else, unless it is told not
// to.
void PutBackSessions(Connection& connection, const std::vector<SessionRow>& rows);
// Counts what is stored of each. How many counted something else.
int RecountSessions(Connection& connection);

// One whose row is gone, under another name.
void AddLostSession(Connection& connection,
                    std::int64_t id,
                    const SessionKey& key,
                    SessionState state);
SessionRow AddSession(Connection& connection, const SessionKey& key, SessionState state);
void WriteSession(Connection& connection, const SessionRow& row);
// Counts one more keyframe in.
SessionRow CountKeyframe(Connection& connection, SessionRow session, const NewKeyframe& keyframe);

}  // namespace atlas
