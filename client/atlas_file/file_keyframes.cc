// What AtlasFile reads of sessions and their keyframes.
#include <algorithm>
#include <utility>

#include "client/atlas_file/atlas_file.h"
#include "server/store/sqlite/store_snapshot.h"

namespace atlas {
namespace {

constexpr std::uint32_t kSessionsAtOnce = 256;
constexpr std::size_t kBytesAtOnce = std::size_t{4} << 20;

SessionSummary SummaryOf(const SessionRecord& record) {
  SessionSummary session;
  session.key = record.key;
  session.state = record.damage == SessionDamage::kRow ? "damaged" : SessionStateName(record.state);
  session.keyframes = record.keyframes;
  session.bytes = record.bytes;
  session.first_time_ms = record.first_time_ms;
  session.last_time_ms = record.last_time_ms;
  session.last_sequence = record.last_sequence;
  session.compacted = record.compacted;
  session.reason = record.reason;
  session.is_damaged = record.damage != SessionDamage::kNone;
  session.changed_revision = record.changed_revision;
  return session;
}

SessionKeyframe KeyframeOf(KeyframeContent content) {
  SessionKeyframe keyframe;
  keyframe.sequence = content.sequence;
  keyframe.damage = content.damage.message();
  keyframe.time_ms = content.time_ms;
  keyframe.T_world_sensor = content.pose;
  if (const auto& prior = content.prior) {
    keyframe.prior = {prior->x_um, prior->y_um, prior->z_um, prior->radius_mm};
  }
  keyframe.blob = std::move(content.blob);
  return keyframe;
}

}  // namespace

Result<std::vector<SessionSummary>> AtlasFile::ListSessions(const std::string& vehicle) {
  std::vector<SessionSummary> sessions;
  SessionKey last{vehicle, {}};
  while (true) {
    const Result<SessionPage> page = snapshot_->ListSessions(last, kSessionsAtOnce);
    if (!page) return Error(page.error());
    for (const SessionRecord& session : page->sessions) {
      if (!vehicle.empty() && session.key.vehicle != vehicle) return sessions;
      sessions.push_back(SummaryOf(session));
      last = session.key;
    }
    if (!page->has_more) return sessions;
  }
}

Result<SessionReading> AtlasFile::ReadKeyframes(
    const SessionKey& session,
    std::optional<std::uint32_t> after_sequence,
    const std::function<Status(SessionKeyframe)>& on_keyframe) {
  if (Status status = session.Validate(); !status.ok()) return Error(std::move(status));
  SessionReading reading;
  reading.revision = revision();
  std::size_t room_bytes = kBytesAtOnce;
  while (true) {
    Result<KeyframeContents> contents =
        snapshot_->ReadKeyframes(session, after_sequence, room_bytes);
    if (!contents) return Error(contents.error());
    for (KeyframeContent& content : contents->keyframes) {
      after_sequence = content.sequence;
      ++reading.keyframes;
      reading.damaged += content.damage.ok() ? 0U : 1U;
      Status status = on_keyframe(KeyframeOf(std::move(content)));
      if (!status.ok()) return Error(std::move(status));
    }
    if (!contents->next_bytes) return reading;
    room_bytes = std::max(kBytesAtOnce, *contents->next_bytes);
  }
}

}  // namespace atlas
