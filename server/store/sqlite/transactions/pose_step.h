// A batch of corrections as one step, as far as it has come: what it moved, which sessions it put
// into another state, which tiles it marks. It takes a revision and a number at its end, and none
// when it changed nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "core/base/status.h"
#include "server/store/event_types.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/store_types.h"

namespace atlas {

class PoseStep {
 public:
  // `limits`: of sessions that come into the map; none: they are live.
  PoseStep(Connection& connection,
           std::string author,
           const std::optional<PlausibilityLimits>& limits);

  // To a pose, unless the keyframe is there; one that a compaction dropped is counted. kNotFound:
  // there is none. kInvalidData: what is stored of it is damaged.
  Status Move(const NewPose& update);
  // A staged session comes into the map, or is quarantined, with its keyframes where they are by
  // now.
  void Publish(const SessionRow& session);
  // A session is staged again. Its keyframes are to be moved behind that: its tiles are those that
  // they leave.
  void StageAgain(const SessionRow& session);

  struct Account {
    EventKind kind = EventKind::kPoses;
    std::string detail;  // of the event, before what was changed; may be empty
    std::uint64_t if_revision = 0;
  };
  // Marks what is to be fused again, and notes the batch and its events.
  PoseBatchResult Finish(const Account& account);

 private:
  void Enter(const SessionRow& session, const SessionJudgement& state);
  void NoteEvents(const Account& account);

  Connection& connection_;
  const std::string author_;
  const std::optional<PlausibilityLimits> limits_;
  PoseBatchResult result_;  // its revision and number are those that it will have
  std::set<TileId> marked_;
};

}  // namespace atlas
