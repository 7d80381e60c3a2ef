#include "server/store/sqlite/transactions/session_judgement.h"

#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_table.h"

namespace atlas {
namespace {

UploadedPlace PlaceOf(std::uint32_t sequence, std::int64_t time_ms, const QuantizedPose& pose) {
  return {sequence, time_ms, pose.x_um, pose.y_um, pose.z_um};
}

// nullopt: nothing tells where it was, or there is no such keyframe.
std::optional<UploadedPlace> FindPlace(Connection& connection, std::int64_t id) {
  if (id == 0) {
    return std::nullopt;
  }
  const auto row = ReadKeyframeRow(connection, id);
  const auto pose = ReadUploadedPose(connection, id);
  if (!row || !pose || !*pose) {
    return std::nullopt;
  }
  return PlaceOf(row->record.key.sequence, row->record.time_ms, **pose);
}

class Judge {
 public:
  Judge(Connection& connection, const SessionRow& session, const PlausibilityLimits& limits)
      : connection_(connection), session_(session), limits_(limits) {}

  // Of two with none between them that is still there.
  std::optional<std::string> Between(const std::optional<UploadedPlace>& before,
                                     const std::optional<UploadedPlace>& behind) const {
    if (!before || !behind) {
      return std::nullopt;
    }
    auto finding = FindImplausible(*before, *behind, limits_);
    const bool has_gap =
        finding && session_.record.compacted > 0 &&
        HasTombstoneBetween(connection_, session_.id, before->sequence, behind->sequence);
    return has_gap ? std::nullopt : finding;
  }

 private:
  Connection& connection_;
  const SessionRow& session_;
  const PlausibilityLimits& limits_;
};

}  // namespace

SessionJudgement JudgeSession(Connection& connection,
                              const SessionRow& session,
                              const PlausibilityLimits& limits) {
  const Judge judge(connection, session, limits);
  std::optional<UploadedPlace> before;
  for (const std::int64_t id : ListSessionKeyframes(connection, session.id)) {
    const std::optional<UploadedPlace> place = FindPlace(connection, id);
    if (auto finding = judge.Between(before, place)) {
      return {SessionState::kQuarantined, *std::move(finding)};
    }
    before = place;
  }
  return {SessionState::kLive, ""};
}

std::optional<SessionJudgement> JudgeArrival(Connection& connection,
                                             const SessionRow& session,
                                             const NewKeyframe& keyframe) {
  const bool is_quarantined = session.record.state == SessionState::kQuarantined;
  if (!keyframe.limits || (!is_quarantined && session.record.state != SessionState::kLive)) {
    return std::nullopt;
  }
  const std::uint32_t sequence = keyframe.key.sequence;
  const auto before = FindPlace(connection, FindKeyframeBefore(connection, session.id, sequence));
  const auto behind = FindPlace(connection, FindKeyframeBehind(connection, session.id, sequence));
  const auto arrived = PlaceOf(sequence, keyframe.time_ms, keyframe.pose);
  const Judge judge(connection, session, *keyframe.limits);
  auto finding = judge.Between(before, arrived);
  if (!finding) {
    finding = judge.Between(arrived, behind);
  }
  if (!is_quarantined) {
    return finding ? std::optional(SessionJudgement{SessionState::kQuarantined, *finding})
                   : std::nullopt;
  }
  if (finding || !judge.Between(before, behind)) {
    return std::nullopt;  // still, or because of others
  }
  auto now = JudgeSession(connection, session, *keyframe.limits);
  return now.state == SessionState::kLive ? std::optional(std::move(now)) : std::nullopt;
}

}  // namespace atlas
