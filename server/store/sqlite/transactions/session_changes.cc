#include "server/store/sqlite/transactions/session_changes.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/tables/start_table.h"

namespace atlas {
namespace {

// Looked at for a page: 5 us each where those of many sessions came in turns.
constexpr std::uint64_t kKeyframesOfPage = 20'000;

struct Change {
  std::string what;
  std::uint64_t revision = 0;
};

Result<std::optional<Change>> FindStateChange(Connection& connection,
                                              std::int64_t session_id,
                                              std::uint64_t since) {
  const auto state = FindStateAfter(connection, session_id, since);
  if (!state) {
    return Error(state.error());
  }
  if (!*state) {
    return std::nullopt;
  }
  return Change{StrCat("it became ", SessionStateName((*state)->state)), (*state)->revision};
}

std::optional<Change> FindPoseChange(Connection& connection,
                                     std::int64_t session_id,
                                     std::uint64_t since) {
  const auto placed = FindPlacedAfter(connection, session_id, since);
  if (!placed) {
    return std::nullopt;
  }
  const std::string how = placed->batch == 0 ? std::string("was uploaded")
                                             : StrCat("was corrected by batch ", placed->batch);
  return Change{StrCat("keyframe ", placed->sequence, " ", how), placed->revision};
}

std::optional<Change> FindCompaction(Connection& connection,
                                     const SessionRow& session,
                                     std::uint64_t since) {
  const std::uint64_t revision =
      session.record.compacted > 0 ? LastCompactionOf(connection, session.id) : 0;
  return revision > since ? std::optional(Change{"keyframes of it were dropped", revision})
                          : std::nullopt;
}

// The first one, but of compactions the last.
Result<std::optional<Change>> FindChange(Connection& connection,
                                         const SessionRow& session,
                                         std::uint64_t since) {
  auto first = FindStateChange(connection, session.id, since);
  if (!first) {
    return first;
  }
  for (auto& other : {FindPoseChange(connection, session.id, since),
                      FindCompaction(connection, session, since)}) {
    if (other && (!*first || other->revision < (*first)->revision)) {
      *first = other;
    }
  }
  return first;
}

Status CheckSession(Connection& connection, const SessionKey& key, std::uint64_t since) {
  const auto session = FindSession(connection, key);
  if (!session) {
    return session.error();
  }
  if (!*session) {
    return {StatusCode::kNotFound, StrCat("session ", key, " is not in the atlas")};
  }
  const auto change = FindChange(connection, **session, since);
  if (!change) {
    return change.error();
  }
  return *change
             ? Status(StatusCode::kConflict, StrCat("session ", key, " changed since revision ",
                                                    since, ": ", (*change)->what, ", at revision ",
                                                    (*change)->revision, "; compute it again"))
             : Status();
}

// Whether the history still tells what changed since.
Status CheckTold(Connection& connection, const StoreIdentity& identity, std::uint64_t revision) {
  const std::uint64_t horizon = ReadCounter(connection, Counter::kHistoryHorizon);
  if (revision < horizon) {
    return {StatusCode::kConflict,
            StrCat("what changed since revision ", revision,
                   " is no longer known, keyframes were dropped or deleted at revision ", horizon,
                   "; compute it again")};
  }
  if (const Status lost = identity.CheckNotLost(revision); !lost.ok()) {
    return {StatusCode::kConflict, StrCat(lost.message(), "; compute it again")};
  }
  return {};
}

}  // namespace

Status CheckUnchanged(Connection& connection,
                      const StoreIdentity& identity,
                      const std::set<SessionKey>& sessions,
                      std::uint64_t revision) {
  const std::uint64_t current = ReadCounter(connection, Counter::kRevision);
  if (revision > current) {
    return {StatusCode::kInvalidArgument,
            StrCat("there is no revision ", revision, " yet, the atlas is at ", current)};
  }
  for (const SessionKey& key : sessions) {
    ATLAS_RETURN_IF_ERROR(CheckSession(connection, key, revision));
  }
  return CheckTold(connection, identity, revision);
}

std::uint64_t ReadChangedRevision(Connection& connection, const SessionRow& session) {
  const std::uint64_t compacted =
      session.record.compacted > 0 ? LastCompactionOf(connection, session.id) : 0;
  return std::max(
      {LastPlacing(connection, session.id), LastStateChange(connection, session.id), compacted});
}

Result<SessionPage> ReadChangedSessions(Connection& connection,
                                        const SessionKey& after,
                                        std::uint32_t limit) {
  auto found = ReadSessions(connection, after, limit + 1);
  if (!found) {
    return Error(found.error());
  }
  SessionPage page;
  std::uint64_t keyframes = 0;
  for (SessionRecord& session : *found) {
    if (page.sessions.size() == limit || keyframes > kKeyframesOfPage) {
      page.has_more = true;
      break;
    }
    keyframes += session.keyframes;
    if (session.damage != SessionDamage::kRow) {
      const auto row = FindSession(connection, session.key);
      session.changed_revision = row && *row ? ReadChangedRevision(connection, **row) : 0;
    }
    page.sessions.push_back(std::move(session));
  }
  return page;
}

}  // namespace atlas
