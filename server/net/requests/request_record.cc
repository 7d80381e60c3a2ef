#include "server/net/requests/request_record.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>

#include <spdlog/spdlog.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

using wire::Envelope;

RequestKind KindOf(const Envelope& request) {
  switch (request.body_case()) {
    case Envelope::kHello:
      return RequestKind::kHello;
    case Envelope::kUploadKeyframe:
      return RequestKind::kUploadKeyframe;
    case Envelope::kUpdatePoses:
      return RequestKind::kUpdatePoses;
    case Envelope::kChangeSession:
      return RequestKind::kChangeSession;
    case Envelope::kQueryRegion:
      return RequestKind::kQueryRegion;
    case Envelope::kSyncRequest:
      return RequestKind::kSync;
    case Envelope::kStatusRequest:
      return RequestKind::kStatus;
    case Envelope::kSessionsRequest:
      return RequestKind::kSessions;
    case Envelope::kWaitRequest:
      return RequestKind::kWait;
    case Envelope::kDigestRequest:
      return RequestKind::kDigest;
    case Envelope::kVerifyRequest:
      return RequestKind::kVerify;
    case Envelope::kCompactRequest:
      return RequestKind::kCompact;
    case Envelope::kWatchRequest:
      return RequestKind::kWatch;
    case Envelope::kCancelRequest:
      return RequestKind::kCancel;
    case Envelope::kLogRequest:
      return RequestKind::kLog;
    case Envelope::kBackupRequest:
      return RequestKind::kBackup;
    case Envelope::kKeyframesRequest:
      return RequestKind::kKeyframes;
    case Envelope::kUndoPoses:
      return RequestKind::kUndoPoses;
    case Envelope::kReadKeyframes:
      return RequestKind::kReadKeyframes;
    default:
      return RequestKind::kUnknown;
  }
}

bool MayWait(const Envelope& request) {
  switch (request.body_case()) {
    case Envelope::kQueryRegion:
      return request.query_region().wait_revision() != 0 ||
             request.query_region().has_at_revision();
    case Envelope::kSyncRequest:
      return request.sync_request().wait_revision() != 0;
    case Envelope::kWaitRequest:
    case Envelope::kDigestRequest:
    case Envelope::kVerifyRequest:
    case Envelope::kCompactRequest:
    case Envelope::kBackupRequest:
    case Envelope::kWatchRequest:
      return true;
    default:
      return false;
  }
}

// A code that this build does not know is a mistake of it.
std::size_t IndexOf(StatusCode code) {
  return std::min(static_cast<std::size_t>(code), kStatusCodes - 1);
}

}  // namespace

RequestRecord::RequestRecord(const PeerRecord& peer,
                             const Envelope& request,
                             Clock::time_point began)
    : peer_(&peer),
      id_(request.request_id()),
      kind_(KindOf(request)),
      may_wait_(MayWait(request)),
      began_(began) {
  peer.counters.in_flight.Add();
}

void RequestRecord::End(const Status& status) {
  if (peer_ == nullptr) {
    return;
  }
  const Clock::time_point now = Clock::now();
  const bool is_slow = !may_wait_ && now - began_ > peer_->slow_request;
  if (!status.ok() || is_slow) {
    Log(status, now);
  }
  Count(status.code(), now);
}

void RequestRecord::Count(StatusCode code, Clock::time_point now) {
  if (peer_ == nullptr) {
    return;
  }
  NetCounters& counters = std::exchange(peer_, nullptr)->counters;
  NetCounters::Kind& kind = counters.kinds[static_cast<std::size_t>(kind_)];
  kind.requests[IndexOf(code)].Add();
  if (is_late_ || code == StatusCode::kTimeout) {
    kind.late.Add();
  }
  kind.durations.Add(now - began_);
  counters.in_flight.Subtract();
}

void RequestRecord::Log(const Status& status, Clock::time_point now) const {
  const auto left_out =
      spdlog::should_log(spdlog::level::info) ? peer_->lines.requests.Take(now) : std::nullopt;
  if (!left_out) {
    return;
  }
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now - began_).count();
  std::string message = StrCat("request ", id_, " (", RequestKindName(kind_), ") ");
  message += status.ok()
                 ? StrCat("took ", ms, " ms")
                 : StrCat("failed: ", StatusCodeName(status.code()), ": ", status.message());
  message += LineBudget::LeftOutText(*left_out);
  LogLine line = peer_->Line(message);
  line.Add("request_id", id_).Add("kind", RequestKindName(kind_));
  line.Add("code", StatusCodeName(status.code()));
  line.Add("duration_ms", static_cast<std::uint64_t>(ms));
  spdlog::info("{}", line.text());
}

}  // namespace atlas
