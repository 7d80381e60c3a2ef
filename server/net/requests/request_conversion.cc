#include "server/net/requests/request_conversion.h"

#include <optional>
#include <string>
#include <utility>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

std::optional<PositionPrior> PriorFromWire(const wire::UploadKeyframe& upload) {
  if (!upload.has_prior()) {
    return std::nullopt;
  }
  const wire::PositionPrior& prior = upload.prior();
  return PositionPrior{prior.x_um(), prior.y_um(), prior.z_um(), prior.radius_mm()};
}

std::string StateName(SessionState state) {
  return std::string(SessionStateName(state));
}

}  // namespace

wire::Envelope ReplyTo(const wire::Envelope& request) {
  wire::Envelope reply;
  reply.set_request_id(request.request_id());
  return reply;
}

Status CheckHello(const wire::Envelope& request, const MapProfile& profile) {
  if (!request.has_hello()) {
    return Status(StatusCode::kInvalidData, "the first frame must be a Hello");
  }
  const wire::Hello& hello = request.hello();
  if (hello.protocol_major() != kProtocolMajor) {
    return Status(StatusCode::kUnsupported,
                  StrCat("protocol version ", hello.protocol_major(), ".", hello.protocol_minor(),
                         ": this daemon speaks ", kProtocolMajor, ".", kProtocolMinor));
  }
  if (!hello.profile().empty()) {
    const Result<MapProfile> expected = ProfileFromWire(hello.profile());
    if (!expected) {
      return expected.error();
    }
    if (*expected != profile) {
      return Status(StatusCode::kInvalidData, "this atlas has another map profile");
    }
  }
  return {};
}

Result<UploadRequest> UploadFromWire(const wire::UploadKeyframe& upload) {
  Result<KeyframeKey> key = KeyFromWire(upload.key());
  if (!key) {
    return Error(key.error());
  }
  Result<QuantizedPose> pose = PoseFromWire(upload.pose());
  if (!pose) {
    return Error(pose.error().WithContext(StrCat("keyframe ", *key)));
  }
  const ByteSpan blob = BytesFromWire(upload.blob());
  return UploadRequest{std::move(*key),
                       upload.time_ms(),
                       *pose,
                       PriorFromWire(upload),
                       Bytes(blob.begin(), blob.end()),
                       upload.staged()};
}

Result<PoseBatchRequest> PosesFromWire(const wire::UpdatePoses& message) {
  PoseBatchRequest request;
  request.author = message.author();
  request.if_revision = message.if_revision();
  request.updates.reserve(static_cast<std::size_t>(message.updates_size()));
  for (const wire::PoseUpdate& update : message.updates()) {
    Result<KeyframeKey> key = KeyFromWire(update.key());
    if (!key) {
      return Error(key.error());
    }
    Result<QuantizedPose> pose = PoseFromWire(update.pose());
    if (!pose) {
      return Error(pose.error().WithContext(StrCat("keyframe ", *key)));
    }
    request.updates.push_back({std::move(*key), *pose});
  }
  request.published.reserve(static_cast<std::size_t>(message.publish_size()));
  for (const wire::SessionName& name : message.publish()) {
    request.published.push_back({name.vehicle(), name.session()});
  }
  return request;
}

Result<SessionChange> SessionChangeFromWire(const wire::ChangeSession& message) {
  SessionChange change{{message.vehicle(), message.session()},
                       SessionAction::kRetract,
                       message.author(),
                       message.reason()};
  switch (message.action()) {
    case wire::ChangeSession::RETRACT:
      return change;
    case wire::ChangeSession::RESTORE:
      change.action = SessionAction::kRestore;
      return change;
    case wire::ChangeSession::RELEASE:
      change.action = SessionAction::kRelease;
      return change;
    case wire::ChangeSession::PURGE:
      change.action = SessionAction::kPurge;
      return change;
    case wire::ChangeSession::PUBLISH:
      change.action = SessionAction::kPublish;
      return change;
    default:
      return Error(StatusCode::kInvalidArgument,
                   StrCat("session: unknown action ", static_cast<int>(message.action()),
                          ", expected to retract (1), restore (2), release (3), purge (4) or "
                          "publish (5)"));
  }
}

CompactionRequest CompactionFromWire(const wire::CompactRequest& message) {
  return {message.before_ms(), message.author()};
}

void UploadToWire(const PutKeyframeResult& result, wire::UploadReply& out) {
  out.set_duplicate(result.is_duplicate);
  out.set_revision(result.revision);
  out.set_tiles_marked(result.tiles_marked);
}

void PosesToWire(const PoseBatchResult& result, wire::UpdatePosesReply& out) {
  out.set_updated(result.updated);
  out.set_tiles_marked(result.tiles_marked);
  out.set_revision(result.revision);
  out.set_batch(result.batch);
  out.set_compacted(result.compacted);
  for (const auto& [key, entered] : result.sessions) {
    wire::UpdatePosesReply::SessionChange& change = *out.add_sessions();
    change.set_vehicle(key.vehicle);
    change.set_session(key.session);
    change.set_state(StateName(entered.state));
    if (entered.state == SessionState::kQuarantined) {
      change.set_reason(entered.reason);
    }
  }
}

void SessionChangeToWire(const SessionChangeResult& result, wire::ChangeSessionReply& out) {
  out.set_changed(result.is_changed);
  out.set_sessions(result.sessions);
  out.set_keyframes(result.keyframes);
  out.set_state(StateName(result.state));
  out.set_tiles_marked(result.tiles_marked);
  out.set_revision(result.revision);
}

void StatusToWire(const ServiceStatus& status, wire::StatusReply& out) {
  const StoreCounts& counts = status.counts;
  out.set_revision(counts.revision);
  out.set_keyframes(counts.keyframes);
  out.set_sessions(counts.sessions);
  out.set_tiles(counts.tiles);
  out.set_dirty_tiles(counts.dirty_tiles);
  out.set_store_bytes(counts.store_bytes);
  out.set_tile_bytes(counts.tile_bytes);
  out.set_keyframe_bytes(counts.keyframe_bytes);
  out.set_cells(counts.cells);
  out.set_multilayer_cells(counts.multilayer_cells);
  out.set_rss_bytes(status.rss_bytes);
  out.set_damaged_tiles(status.damaged_tiles);
  out.set_compacted(counts.compacted);
  const RoomFigures& room = status.room;
  out.set_used_bytes(room.used_bytes);
  out.set_store_limit_bytes(room.limits.store_bytes);
  if (room.free_disk_bytes) {
    out.set_disk_free_bytes(*room.free_disk_bytes);
  }
  out.set_disk_floor_bytes(room.limits.disk_floor_bytes);
  out.set_refusing(std::string(StatusReasonName(room.refusing.reason())));
  out.set_quarantined(counts.quarantined);
}

void WaitToWire(const WaitOutcome& outcome, wire::WaitReply& out) {
  out.set_revision(outcome.revision);
  out.set_dirty_tiles(outcome.dirty_tiles);
  out.set_timed_out(outcome.is_timed_out);
}

void SessionToWire(const SessionRecord& record, wire::SessionInfo& out) {
  out.set_vehicle(record.key.vehicle);
  out.set_session(record.key.session);
  out.set_state(record.damage == SessionDamage::kRow ? "damaged" : StateName(record.state));
  out.set_damaged(record.damage != SessionDamage::kNone);
  out.set_keyframes(record.keyframes);
  out.set_bytes(record.bytes);
  out.set_first_time_ms(record.first_time_ms);
  out.set_last_time_ms(record.last_time_ms);
  out.set_last_sequence(record.last_sequence);
  out.set_compacted(record.compacted);
  out.set_reason(record.reason);
  out.set_changed_revision(record.changed_revision);
}

void DigestToWire(const AtlasDigest& digest, wire::DigestReply& out) {
  out.set_sha256(BytesToWire(digest.sha256));
  out.set_tiles(digest.tiles);
  out.set_revision(digest.revision);
}

void CompactionToWire(const CompactionReport& report, wire::CompactReply& out) {
  out.set_dropped(report.stored.dropped);
  out.set_bytes(report.stored.bytes);
  out.set_tiles_checked(report.tiles_checked);
  out.set_horizon(report.stored.horizon);
  out.set_revision(report.stored.revision);
}

void ProgressToWire(const BackupProgress& progress, wire::BackupReply& out) {
  out.set_stage(progress.stage == BackupProgress::Stage::kCopying ? wire::BackupReply::COPYING
                                                                  : wire::BackupReply::VERIFYING);
  out.set_done_bytes(progress.done_bytes);
  out.set_total_bytes(progress.total_bytes);
}

void BackupToWire(const AtlasFacts& facts, wire::BackupReply& out) {
  out.set_stage(wire::BackupReply::DONE);
  out.set_done_bytes(facts.bytes);
  out.set_total_bytes(facts.bytes);
  out.set_revision(facts.revision);
  out.set_keyframes(facts.keyframes);
  out.set_tiles(facts.tiles);
  out.set_sha256(BytesToWire(facts.sha256));
}

void BackupsToWire(const std::vector<StoredBackup>& backups, wire::BackupReply& out) {
  for (const StoredBackup& backup : backups) {
    wire::BackupReply::Backup& line = *out.add_backups();
    line.set_name(backup.name);
    line.set_bytes(backup.bytes);
    line.set_time_ms(backup.time_ms);
  }
}

void EventsToWire(const std::vector<Event>& events, wire::LogReply& out) {
  for (const Event& event : events) {
    wire::LogReply::Event& item = *out.add_events();
    item.set_id(event.id);
    item.set_revision(event.revision);
    item.set_time_ms(event.time_ms);
    item.set_kind(event.is_damaged ? std::string("damaged") : std::string(EventName(event.kind)));
    item.set_damaged(event.is_damaged);
    item.set_author(event.author);
    item.set_subject(event.subject);
    item.set_detail(event.detail);
  }
}

VerifyRequest VerifyFromWire(const wire::VerifyRequest& message) {
  return {message.rebuild(), message.repair(), message.author()};
}

void VerifyToWire(const VerifyReport& report, wire::VerifyReply& out) {
  out.set_restored(report.restored);
  out.set_given_up(report.given_up);
  out.set_checked(report.checked);
  out.set_damaged(report.damaged);
  out.set_mismatched(report.mismatched);
  out.set_revision(report.revision);
  for (const std::string& finding : report.findings) {
    out.add_findings(finding);
  }
}

}  // namespace atlas
