#include "server/store/sqlite/transactions/pose_transactions.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_batch_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/transactions/pose_step.h"
#include "server/store/sqlite/transactions/session_changes.h"

namespace atlas {
namespace {

Status CheckDiffer(const PoseBatch& batch) {
  std::set<KeyframeKey> keyframes;
  for (const NewPose& update : batch.poses) {
    if (!keyframes.insert(update.key).second) {
      return Status(StatusCode::kInvalidData,
                    StrCat("pose batch: keyframe ", update.key, " is in it twice"));
    }
  }
  std::set<SessionKey> sessions;
  for (const SessionKey& key : batch.published) {
    if (!sessions.insert(key).second) {
      return Status(StatusCode::kInvalidData,
                    StrCat("pose batch: session ", key, " is to be published twice"));
    }
  }
  return {};
}

// One that is in the map already stays as it is.
Status Publish(Connection& connection, const SessionKey& key, PoseStep& step) {
  const auto session = FindSession(connection, key);
  if (!session) {
    return session.error();
  }
  if (!*session) {
    return {StatusCode::kNotFound, StrCat("session ", key, " is not in the atlas")};
  }
  const SessionState state = (*session)->record.state;
  if (state == SessionState::kStaged) {
    step.Publish(**session);
    return {};
  }
  return IsInMap(state) ? Status()
                        : Status(StatusCode::kConflict,
                                 StrCat("session ", key, " is ", SessionStateName(state),
                                        ", expected it staged, or in the map"));
}

Result<StoredBatch> FindBatch(Connection& connection, std::uint64_t id) {
  auto batch = ReadPoseBatch(connection, id);
  if (!batch) {
    return Error(batch.error());
  }
  if (!*batch) {
    return Error(StatusCode::kNotFound, StrCat("there is no batch ", id));
  }
  const std::uint64_t horizon = ReadCounter(connection, Counter::kHistoryHorizon);
  if ((*batch)->revision <= horizon) {
    return Error(StatusCode::kNotFound,
                 StrCat("batch ", id, ": what was before it is no longer kept, keyframes were ",
                        "dropped or deleted at revision ", horizon));
  }
  return **std::move(batch);
}

Status Differs(const StoredBatch& batch) {
  return {StatusCode::kInvalidData, StrCat("store: what batch ", batch.id, " changed is damaged")};
}

// Where a keyframe was before the batch, if it is where the batch put it, and nowhere else since
// but there and back. `key`: of it.
Result<QuantizedPose> ReadBefore(Connection& connection,
                                 std::int64_t id,
                                 const KeyframeKey& key,
                                 const StoredBatch& batch) {
  const auto now = ReadPoseChange(connection, id);
  const auto after = ReadPoseChangeAt(connection, id, batch.revision);
  const auto before = ReadPoseAt(connection, id, batch.revision - 1);
  for (const Status& status : {now ? Status() : now.error(), after ? Status() : after.error(),
                               before ? Status() : before.error()}) {
    if (!status.ok()) {
      return Error(status);
    }
  }
  if (!*before || !*after || (*after)->batch != batch.id) {
    return Error(Differs(batch));
  }
  if (now->pose != (*after)->pose) {
    return Error(StatusCode::kConflict,
                 StrCat("batch ", batch.id, ": keyframe ", key, " was corrected since, by batch ",
                        now->batch, " at revision ", now->revision));
  }
  return **before;
}

// Those that the batch put into another state, which they are in still.
Result<std::vector<SessionRow>> ReadSessionsOf(Connection& connection, const StoredBatch& batch) {
  std::vector<SessionRow> sessions;
  for (const std::int64_t id : ListSessionsChangedAt(connection, batch.revision)) {
    auto session = ReadSession(connection, id);
    if (!session) {
      return Error(session.error());
    }
    const auto later = FindStateAfter(connection, id, batch.revision);
    if (!later) {
      return Error(later.error());
    }
    if (*later) {
      return Error(
          StatusCode::kConflict,
          StrCat("batch ", batch.id, ": session ", session->record.key, " became ",
                 SessionStateName((*later)->state), " since, at revision ", (*later)->revision));
    }
    sessions.push_back(*std::move(session));
  }
  return sessions;
}

Result<std::vector<KeyframeRecord>> ReadKeyframesOf(Connection& connection,
                                                    const StoredBatch& batch) {
  std::vector<KeyframeRecord> keyframes;
  for (const std::int64_t id : ListKeyframesOfBatch(connection, batch.id)) {
    auto keyframe = ReadKeyframeRecord(connection, id);
    if (!keyframe) {
      return Error(keyframe.error());
    }
    keyframes.push_back(*std::move(keyframe));
  }
  if (keyframes.size() != batch.updated) {
    return Error(Differs(batch));
  }
  std::sort(keyframes.begin(), keyframes.end(),
            [](const KeyframeRecord& a, const KeyframeRecord& b) { return a.key < b.key; });
  return keyframes;
}

// Still where the batch moved it, and `undone` is where it was before.
Status CheckUndone(Connection& connection, const NewPose& undone, const StoredBatch& batch) {
  const auto keyframe = FindKeyframeRecord(connection, undone.key);
  if (!keyframe) {
    return keyframe.error();
  }
  if (!*keyframe) {
    return Differs(batch);  // dropped, which would have moved the horizon
  }
  const auto before = ReadBefore(connection, (*keyframe)->id, undone.key, batch);
  if (!before) {
    return before.error();
  }
  return *before == undone.pose ? Status() : Differs(batch);
}

}  // namespace

Result<PoseBatchResult> UpdatePosesInStore(Connection& connection,
                                           const StoreIdentity& identity,
                                           const PoseBatch& batch) {
  Status status = CheckDiffer(batch);
  if (status.ok() && batch.if_revision != 0) {
    status = CheckUnchanged(connection, identity, batch.Sessions(), batch.if_revision);
  }
  PoseStep step(connection, batch.author, batch.limits);
  for (auto update = batch.poses.begin(); update != batch.poses.end() && status.ok(); ++update) {
    status = step.Move(*update);
  }
  for (auto key = batch.published.begin(); key != batch.published.end() && status.ok(); ++key) {
    status = Publish(connection, *key, step);
  }
  if (!status.ok()) {
    return Error(std::move(status));
  }
  return step.Finish({EventKind::kPoses, "", batch.if_revision});
}

Result<BatchToUndo> ReadBatchToUndo(Connection& connection, std::uint64_t id) {
  const auto batch = FindBatch(connection, id);
  if (!batch) {
    return Error(batch.error());
  }
  auto keyframes = ReadKeyframesOf(connection, *batch);
  if (!keyframes) {
    return Error(keyframes.error());
  }
  BatchToUndo undo{id, {}};
  undo.keyframes.reserve(keyframes->size());
  for (KeyframeRecord& keyframe : *keyframes) {
    const auto before = ReadBefore(connection, keyframe.id, keyframe.key, *batch);
    if (!before) {
      return Error(before.error());
    }
    undo.keyframes.push_back({std::move(keyframe), *before});
  }
  if (const auto sessions = ReadSessionsOf(connection, *batch); !sessions) {
    return Error(sessions.error());
  }
  return undo;
}

Result<PoseBatchResult> UndoPosesInStore(Connection& connection, const PoseUndo& undo) {
  const auto batch = FindBatch(connection, undo.batch);
  if (!batch) {
    return Error(batch.error());
  }
  const auto sessions = ReadSessionsOf(connection, *batch);
  if (!sessions) {
    return Error(sessions.error());
  }
  if (undo.poses.size() != batch->updated || (undo.poses.empty() && sessions->empty())) {
    return Error(Differs(*batch));
  }
  PoseStep step(connection, undo.author, undo.limits);
  for (const SessionRow& session : *sessions) {
    if (session.record.state != SessionState::kStaged) {
      step.StageAgain(session);
    }
  }
  for (const NewPose& undone : undo.poses) {
    Status status = CheckUndone(connection, undone, *batch);
    status = status.ok() ? step.Move(undone) : std::move(status);
    if (!status.ok()) {
      return Error(std::move(status));
    }
  }
  for (const SessionRow& session : *sessions) {
    if (session.record.state == SessionState::kStaged) {
      step.Publish(session);
    }
  }
  return step.Finish({EventKind::kPosesUndone, StrCat("batch ", undo.batch, ": "), 0});
}

}  // namespace atlas
