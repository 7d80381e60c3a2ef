#include "server/store/sqlite/transactions/session_judgement.h"

#include <vector>

#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_table.h"

namespace atlas {
namespace {

// nullopt: nothing tells where it was.
using Place = std::optional<UploadedPlace>;

UploadedPlace PlaceOf(std::uint32_t sequence, std::int64_t time_ms, const QuantizedPose& pose) {
  return {sequence, time_ms, pose.x_um, pose.y_um, pose.z_um};
}

Place ReadPlace(Connection& connection, std::int64_t id) {
  const auto row = ReadKeyframeRow(connection, id);
  const auto pose = ReadUploadedPose(connection, id);
  if (!row || !pose || !*pose) {
    return std::nullopt;
  }
  return PlaceOf(row->record.key.sequence, row->record.time_ms, **pose);
}

std::vector<Place> ReadPlaces(Connection& connection, const std::vector<std::int64_t>& ids) {
  std::vector<Place> places;
  places.reserve(ids.size());
  for (const std::int64_t id : ids) {
    places.push_back(ReadPlace(connection, id));
  }
  return places;
}

// Of a session's keyframes in their order.
class Judge {
 public:
  Judge(Connection& connection, const SessionRow& session, const PlausibilityLimits& limits)
      : connection_(connection), session_(session), track_(limits) {}

  // What cannot be on a way to the next one, with none between that is not there any more.
  std::optional<std::string> Add(const Place& place) {
    if (!place) {
      track_.Break();
      return std::nullopt;
    }
    const auto finding = track_.Add(*place);
    const bool has_gap = finding && session_.record.compacted > 0 &&
                         HasTombstoneBetween(connection_, session_.id, finding->from, finding->to);
    return finding && !has_gap ? std::optional(finding->reason) : std::nullopt;
  }

 private:
  Connection& connection_;
  const SessionRow& session_;
  UploadedTrack track_;
};

std::optional<std::string> FindIn(const std::vector<Place>& places, Judge judge) {
  std::optional<std::string> finding;
  for (auto place = places.begin(); place != places.end() && !finding; ++place) {
    finding = judge.Add(*place);
  }
  return finding;
}

}  // namespace

SessionJudgement JudgeSession(Connection& connection,
                              const SessionRow& session,
                              const PlausibilityLimits& limits) {
  Judge judge(connection, session, limits);
  for (const std::int64_t id : ListSessionKeyframes(connection, session.id)) {
    if (auto finding = judge.Add(ReadPlace(connection, id))) {
      return {SessionState::kQuarantined, *std::move(finding)};
    }
  }
  return {SessionState::kLive, ""};
}

SessionJudgement JudgeEntering(Connection& connection,
                               const SessionRow& session,
                               SessionState unjudged,
                               const std::optional<PlausibilityLimits>& limits,
                               const std::string& reason) {
  SessionJudgement judgement{unjudged, ""};
  if (limits) {
    judgement = JudgeSession(connection, session, *limits);
  }
  if (judgement.state != SessionState::kQuarantined) {
    judgement.reason = reason;
  }
  return judgement;
}

std::optional<SessionJudgement> JudgeArrival(Connection& connection,
                                             const SessionRow& session,
                                             const NewKeyframe& keyframe) {
  const bool is_quarantined = session.record.state == SessionState::kQuarantined;
  if (!keyframe.limits || (!is_quarantined && session.record.state != SessionState::kLive)) {
    return std::nullopt;
  }
  const std::uint32_t sequence = keyframe.key.sequence;
  const auto before = ReadPlaces(
      connection, ListKeyframesBefore(connection, session.id, sequence, kMostJudgedSteps));
  const auto behind = ReadPlaces(
      connection, ListKeyframesBehind(connection, session.id, sequence, kMostJudgedSteps));
  const Judge judge(connection, session, *keyframe.limits);
  std::vector<Place> places = before;
  places.emplace_back(PlaceOf(sequence, keyframe.time_ms, keyframe.pose));
  places.insert(places.end(), behind.begin(), behind.end());
  auto finding = FindIn(places, judge);
  if (!is_quarantined) {
    return finding
               ? std::optional(SessionJudgement{SessionState::kQuarantined, *std::move(finding)})
               : std::nullopt;
  }
  places.erase(places.begin() + static_cast<std::ptrdiff_t>(before.size()));
  if (finding || !FindIn(places, judge)) {
    return std::nullopt;  // still, or because of others
  }
  auto now = JudgeSession(connection, session, *keyframe.limits);
  return now.state == SessionState::kLive ? std::optional(std::move(now)) : std::nullopt;
}

}  // namespace atlas
