// Between the messages of requests and replies and what AtlasService takes and gives.
#pragma once

#include "proto/wire/envelope.h"
#include "server/service/atlas_service.h"

namespace atlas {

// An envelope that answers `request`, without a body yet.
wire::Envelope ReplyTo(const wire::Envelope& request);

// Not ok: the first frame of a connection is no Hello, or one of another protocol (kUnsupported) or
// of another map (kInvalidData).
Status CheckHello(const wire::Envelope& request, const MapProfile& profile);

// The error names the keyframe.
Result<UploadRequest> UploadFromWire(const wire::UploadKeyframe& upload);
Result<PoseBatchRequest> PosesFromWire(const wire::UpdatePoses& message);
// kInvalidArgument on an action that this version does not know.
Result<SessionChange> SessionChangeFromWire(const wire::ChangeSession& message);

CompactionRequest CompactionFromWire(const wire::CompactRequest& message);

void UploadToWire(const PutKeyframeResult& result, wire::UploadReply& out);
void PosesToWire(const PoseBatchResult& result, wire::UpdatePosesReply& out);
void SessionChangeToWire(const SessionChangeResult& result, wire::ChangeSessionReply& out);
void StatusToWire(const ServiceStatus& status, wire::StatusReply& out);
void WaitToWire(const WaitOutcome& outcome, wire::WaitReply& out);
void SessionToWire(const SessionRecord& record, wire::SessionInfo& out);
void DigestToWire(const AtlasDigest& digest, wire::DigestReply& out);
void CompactionToWire(const CompactionReport& report, wire::CompactReply& out);
void ProgressToWire(const BackupProgress& progress, wire::BackupReply& out);
void BackupToWire(const AtlasFacts& facts, wire::BackupReply& out);
void BackupsToWire(const std::vector<StoredBackup>& backups, wire::BackupReply& out);
void EventsToWire(const std::vector<Event>& events, wire::LogReply& out);
VerifyRequest VerifyFromWire(const wire::VerifyRequest& message);
// Who did it: `known` by a certificate or a token, or else who it says.
inline std::string AuthorOf(const std::string& known, std::string claimed) {
  return known.empty() ? std::move(claimed) : known;
}
void VerifyToWire(const VerifyReport& report, wire::VerifyReply& out);

}  // namespace atlas
