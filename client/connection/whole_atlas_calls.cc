// What AtlasClient asks of the atlas as a whole: waits, digests, verifications, compactions, and
// changes of whole sessions.
#include <algorithm>
#include <utility>

#include "client/connection/atlas_client.h"
#include "client/connection/rpc_channel.h"
#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

using Body = wire::Envelope;
using std::chrono::milliseconds;

constexpr std::uint32_t kMinorWithLog = 8;
constexpr std::uint32_t kMinorWithQuarantine = 9;
constexpr std::uint32_t kMinorWithStaged = 10;

wire::ChangeSession::Action ActionToWire(SessionAction action) {
  switch (action) {
    case SessionAction::kRetract:
      return wire::ChangeSession::RETRACT;
    case SessionAction::kRestore:
      return wire::ChangeSession::RESTORE;
    case SessionAction::kRelease:
      return wire::ChangeSession::RELEASE;
    case SessionAction::kPublish:
      return wire::ChangeSession::PUBLISH;
    case SessionAction::kPurge:
      break;
  }
  return wire::ChangeSession::PURGE;
}

Result<VerifySummary> CallVerify(RpcChannel& channel,
                                 wire::Envelope& request,
                                 milliseconds timeout) {
  request.mutable_verify_request()->set_timeout_ms(TimeoutField(timeout));
  const auto reply = channel.Call(request, Body::kVerifyReply, timeout);
  if (!reply) return Error(reply.error());
  const wire::VerifyReply& done = reply->verify_reply();
  return VerifySummary{done.checked(),    done.damaged(),
                       done.mismatched(), {done.findings().begin(), done.findings().end()},
                       done.revision(),   done.restored(),
                       done.given_up()};
}

Result<SessionChangeSummary> CallChangeSession(RpcChannel& channel,
                                               const SessionKey& key,
                                               SessionAction action,
                                               const std::string& author,
                                               const std::string& reason) {
  wire::Envelope request;
  wire::ChangeSession& change = *request.mutable_change_session();
  change.set_vehicle(key.vehicle);
  change.set_session(key.session);
  change.set_action(ActionToWire(action));
  change.set_author(author);
  change.set_reason(reason);
  const auto reply = channel.Call(request, Body::kChangeSessionReply);
  if (!reply) return Error(reply.error());
  const wire::ChangeSessionReply& done = reply->change_session_reply();
  return SessionChangeSummary{done.changed(),  done.state(),    done.tiles_marked(),
                              done.revision(), done.sessions(), done.keyframes()};
}

}  // namespace

Result<WaitSummary> AtlasClient::WaitUntilFused(milliseconds timeout) {
  wire::Envelope request;
  request.mutable_wait_request()->set_timeout_ms(TimeoutField(timeout));
  const auto reply = channel_->Call(request, Body::kWaitReply, timeout);
  if (!reply) return Error(reply.error());
  const wire::WaitReply& done = reply->wait_reply();
  if (done.timed_out()) {
    return Error(StatusCode::kTimeout,
                 StrCat(done.dirty_tiles(), " tiles are still to be fused after ",
                        static_cast<double>(timeout.count()) * 1e-3, " s"));
  }
  return WaitSummary{done.revision(), done.dirty_tiles()};
}

Result<SessionChangeSummary> AtlasClient::ChangeSession(const SessionKey& key,
                                                        SessionAction action,
                                                        const std::string& author,
                                                        const std::string& reason) {
  if (Status status = key.Validate(); !status.ok()) return Error(std::move(status));
  if (action == SessionAction::kRelease || action == SessionAction::kPurge) {
    if (Status status = CheckMinor(kMinorWithQuarantine, "to release or purge a session");
        !status.ok()) {
      return Error(std::move(status));
    }
  }
  if (action == SessionAction::kPublish) {
    if (Status status = CheckMinor(kMinorWithStaged, "to publish a session"); !status.ok()) {
      return Error(std::move(status));
    }
  }
  return CallChangeSession(*channel_, key, action, author, reason);
}

Result<SessionChangeSummary> AtlasClient::ChangeVehicle(const std::string& vehicle,
                                                        SessionAction action,
                                                        const std::string& author,
                                                        const std::string& reason) {
  if (Status status = CheckMinor(kMinorWithLog, "a change of all of a vehicle's sessions");
      !status.ok()) {
    return Error(std::move(status));
  }
  if (Status status = ValidateName("vehicle", vehicle); !status.ok()) {
    return Error(std::move(status));
  }
  return CallChangeSession(*channel_, {vehicle, ""}, action, author, reason);
}

Result<DigestSummary> AtlasClient::Digest(milliseconds timeout,
                                          std::optional<std::uint64_t> at_revision) {
  if (Status status = CheckPast(at_revision); !status.ok()) return Error(std::move(status));
  wire::Envelope request;
  wire::DigestRequest& digest = *request.mutable_digest_request();
  digest.set_timeout_ms(TimeoutField(timeout));
  if (at_revision) digest.set_at_revision(*at_revision);
  const auto reply = channel_->Call(request, Body::kDigestReply, timeout);
  if (!reply) return Error(reply.error());
  const wire::DigestReply& done = reply->digest_reply();
  const ByteSpan sha256 = BytesFromWire(done.sha256());
  return DigestSummary{Bytes(sha256.begin(), sha256.end()), done.tiles(), done.revision()};
}

Result<CompactionSummary> AtlasClient::Compact(std::int64_t before_ms,
                                               const std::string& author,
                                               milliseconds timeout) {
  wire::Envelope request;
  wire::CompactRequest& compact = *request.mutable_compact_request();
  compact.set_before_ms(before_ms);
  compact.set_author(author);
  compact.set_timeout_ms(TimeoutField(timeout));
  const auto reply = channel_->Call(request, Body::kCompactReply, timeout);
  if (!reply) return Error(reply.error());
  const wire::CompactReply& done = reply->compact_reply();
  return CompactionSummary{done.dropped(), done.bytes(), done.tiles_checked(), done.horizon(),
                           done.revision()};
}

Result<VerifySummary> AtlasClient::Verify(bool is_rebuild, milliseconds timeout) {
  wire::Envelope request;
  request.mutable_verify_request()->set_rebuild(is_rebuild);
  return CallVerify(*channel_, request, timeout);
}

Result<VerifySummary> AtlasClient::Repair(bool is_rebuild,
                                          const std::string& author,
                                          milliseconds timeout) {
  if (Status status = CheckMinor(kMinorWithLog, "a repair"); !status.ok()) {
    return Error(std::move(status));
  }
  wire::Envelope request;
  request.mutable_verify_request()->set_rebuild(is_rebuild);
  request.mutable_verify_request()->set_repair(true);
  request.mutable_verify_request()->set_author(author);
  return CallVerify(*channel_, request, timeout);
}

Result<BackupSummary> AtlasClient::Backup(
    const std::string& name,
    const std::string& author,
    milliseconds timeout,
    const std::function<void(const BackupStage&)>& on_progress) {
  if (Status status = CheckMinor(kMinorWithLog, "a backup"); !status.ok()) {
    return Error(std::move(status));
  }
  if (Status status = ValidateName("backup", name); !status.ok()) return Error(std::move(status));
  wire::Envelope request;
  wire::BackupRequest& backup = *request.mutable_backup_request();
  backup.set_name(name);
  backup.set_author(author);
  backup.set_timeout_ms(TimeoutField(timeout));
  const Result<std::uint64_t> id = channel_->Send(request);
  if (!id) return Error(id.error());
  const auto latest = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(latest - std::chrono::steady_clock::now());
    const auto reply = channel_->ReceiveFor(*id, Body::kBackupReply, Body::kBackupReply,
                                            std::max(left, milliseconds(0)));
    if (!reply) return Error(reply.error());
    const wire::BackupReply& done = reply->backup_reply();
    if (done.stage() == wire::BackupReply::DONE) {
      const ByteSpan sha256 = BytesFromWire(done.sha256());
      return BackupSummary{done.done_bytes(), done.revision(), done.keyframes(), done.tiles(),
                           Bytes(sha256.begin(), sha256.end())};
    }
    on_progress(
        {done.stage() == wire::BackupReply::VERIFYING, done.done_bytes(), done.total_bytes()});
  }
}

Result<std::vector<BackupFile>> AtlasClient::ListBackups() {
  if (Status status = CheckMinor(kMinorWithLog, "a list of backups"); !status.ok()) {
    return Error(std::move(status));
  }
  wire::Envelope request;
  request.mutable_backup_request();
  const auto reply = channel_->Call(request, Body::kBackupReply);
  if (!reply) return Error(reply.error());
  std::vector<BackupFile> backups;
  for (const wire::BackupReply::Backup& backup : reply->backup_reply().backups()) {
    backups.push_back({backup.name(), backup.bytes(), backup.time_ms()});
  }
  return backups;
}

Result<std::vector<AtlasEvent>> AtlasClient::ListEvents(std::uint64_t after_id) {
  if (Status status = CheckMinor(kMinorWithLog, "the log"); !status.ok()) {
    return Error(std::move(status));
  }
  wire::Envelope request;
  request.mutable_log_request()->set_after_id(after_id);
  const auto reply = channel_->Call(request, Body::kLogReply);
  if (!reply) return Error(reply.error());
  std::vector<AtlasEvent> events;
  for (const wire::LogReply::Event& event : reply->log_reply().events()) {
    events.push_back({event.id(), event.revision(), event.time_ms(), event.kind(), event.author(),
                      event.subject(), event.detail(), event.damaged()});
  }
  return events;
}

}  // namespace atlas
