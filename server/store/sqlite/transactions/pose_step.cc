#include "server/store/sqlite/transactions/pose_step.h"

#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_batch_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/sqlite/transactions/session_judgement.h"
#include "server/store/sqlite/transactions/session_transition.h"

namespace atlas {
namespace {

// Of an event's detail: the others have lines of their own, as these have.
constexpr std::size_t kNamesBytes = 150;

// "; published: a/b, c/d and 2 more", or nothing.
std::string NamesOf(const std::vector<ChangedSession>& sessions, bool is_published) {
  std::string text;
  std::size_t left_out = 0;
  for (const ChangedSession& session : sessions) {
    if (session.is_published() != is_published) {
      continue;
    }
    if (text.size() > kNamesBytes) {
      ++left_out;
      continue;
    }
    const bool is_live = session.entered.state != SessionState::kQuarantined;
    text += StrCat(text.empty() ? (is_published ? "; published: " : "; staged again: ") : ", ",
                   session.key, is_live ? "" : " (quarantined)");
  }
  return left_out == 0 ? text : StrCat(text, " and ", left_out, " more");
}

}  // namespace

PoseStep::PoseStep(Connection& connection,
                   std::string author,
                   const std::optional<PlausibilityLimits>& limits)
    : connection_(connection), author_(std::move(author)), limits_(limits) {
  result_.revision = ReadCounter(connection, Counter::kRevision) + 1;
  result_.batch =
      NextNumber(connection, Counter::kBatch, "SELECT 1 FROM pose_batches WHERE id = ?");
}

Status PoseStep::Move(const NewPose& update) {
  const auto stored = FindKeyframeRecord(connection_, update.key);
  if (!stored) {
    return stored.error();
  }
  if (!*stored) {
    ++result_.compacted;
    return {};
  }
  const KeyframeRecord& keyframe = **stored;
  if (keyframe.pose == update.pose) {
    return {};
  }
  ++result_.updated;
  WritePose(connection_, {keyframe.id, update.pose, result_.revision, result_.batch, author_});
  if (IsInMap(keyframe.session_state)) {
    const std::vector<TileId> left = ReadFootprint(connection_, keyframe.id);
    marked_.insert(left.begin(), left.end());
    marked_.insert(update.footprint.begin(), update.footprint.end());
  }
  WriteFootprint(connection_, keyframe.id, update.footprint, result_.revision);
  return {};
}

void PoseStep::Publish(const SessionRow& session) {
  Enter(session, JudgeEntering(connection_, session, SessionState::kLive, limits_,
                               StrCat("by batch ", result_.batch)));
}

void PoseStep::StageAgain(const SessionRow& session) {
  Enter(session, {SessionState::kStaged, StrCat("by batch ", result_.batch)});
}

void PoseStep::Enter(const SessionRow& session, const SessionJudgement& state) {
  if (IsInMap(session.record.state) != IsInMap(state.state)) {
    const std::vector<TileId> tiles = ReadSessionFootprint(connection_, session.id);
    marked_.insert(tiles.begin(), tiles.end());
  }
  EnterState(connection_, session, {state.state, result_.revision, author_, state.reason});
  result_.sessions.push_back({session.record.key, state});
}

PoseBatchResult PoseStep::Finish(const Account& account) {
  if (result_.updated == 0 && result_.sessions.empty()) {
    --result_.revision;
    result_.batch = 0;
    return std::move(result_);
  }
  NextRevision(connection_);
  SetCounter(connection_, Counter::kBatch, result_.batch);
  result_.tiles_marked = static_cast<std::uint32_t>(marked_.size());
  for (const TileId& tile : marked_) {
    MarkTile(connection_, tile, result_.revision, result_.revision);
  }
  WritePoseBatch(connection_,
                 {result_.batch, result_.revision, author_, result_.updated, account.if_revision});
  NoteEvents(account);
  return std::move(result_);
}

void PoseStep::NoteEvents(const Account& account) {
  const std::string batch = StrCat("batch ", result_.batch);
  AddEvent(connection_,
           {account.kind, author_, batch,
            StrCat(account.detail, result_.updated, " poses, ", result_.tiles_marked, " tiles",
                   NamesOf(result_.sessions, true), NamesOf(result_.sessions, false))});
  for (const auto& [key, entered] : result_.sessions) {
    const bool is_staged = entered.state == SessionState::kStaged;
    AddEvent(connection_, {is_staged ? EventKind::kSessionStaged : EventKind::kSessionPublished,
                           author_, StrCat(key), batch});
    if (entered.state == SessionState::kQuarantined) {
      AddEvent(connection_,
               {EventKind::kSessionQuarantined, kAtlasItself, StrCat(key), entered.reason});
    }
  }
}

}  // namespace atlas
