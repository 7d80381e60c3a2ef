#include "client/merge/source/session_transfer.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "client/connection/keyframe_uploader.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::chrono::minutes kPatience{10};  // with a daemon that is busy

class Transfer {
 public:
  Transfer(SessionSource& from, AtlasClient& to)
      : from_(from), uploader_(to, {.patience = kPatience}) {}

  Status Bring(const SessionSummary& session, const std::function<Status()>& on_keyframe) {
    ++report_.sessions;
    const auto reading =
        from_.ReadKeyframes(session.key, [&](const SessionKeyframe& keyframe) -> Status {
          ATLAS_RETURN_IF_ERROR(on_keyframe());
          if (!keyframe.damage.empty()) {
            LeaveOut(session.key, StrCat("keyframe ", keyframe.sequence, ": ", keyframe.damage));
            return {};
          }
          ++report_.keyframes;
          return uploader_.Upload({.key = {session.key, keyframe.sequence},
                                   .time_ms = keyframe.time_ms,
                                   .T_world_sensor = keyframe.T_world_sensor,
                                   .blob = keyframe.blob,
                                   .is_staged = true,
                                   .prior = keyframe.prior});
        });
    return reading ? Status() : reading.error();
  }

  void LeaveOut(const SessionKey& key, std::string why) {
    report_.left_out.push_back({key, std::move(why)});
  }

  Result<TransferReport> Finish() {
    if (Status status = uploader_.Finish(); !status.ok()) return Error(std::move(status));
    report_.duplicates = uploader_.totals().duplicates;
    return std::move(report_);
  }

 private:
  SessionSource& from_;
  KeyframeUploader uploader_;
  TransferReport report_;
};

}  // namespace

std::string WhyNotBrought(const SessionSummary& session) {
  if (session.is_damaged) return StrCat("damaged: ", session.reason);
  return session.IsInMap() || session.state == "staged" ? "" : session.state;
}

Status CheckTransfer(const SessionSource& from, const MapProfile& to) {
  if (from.profile() == to) return {};
  return {StatusCode::kInvalidArgument,
          StrCat(from.name(),
                 " has another map profile than the atlas that it is brought to: its keyframes "
                 "cannot be fused there")};
}

Result<TransferReport> TransferSessions(
    SessionSource& from,
    AtlasClient& to,
    const std::function<Status(std::size_t done, std::size_t all)>& progress) {
  if (Status status = CheckTransfer(from, to.profile()); !status.ok()) {
    return Error(std::move(status));
  }
  const auto sessions = from.ListSessions();
  if (!sessions) return Error(sessions.error());
  std::size_t all = 0;
  for (const SessionSummary& session : *sessions) {
    all += WhyNotBrought(session).empty() ? session.keyframes : 0;
  }
  std::size_t done = 0;
  Transfer transfer(from, to);
  for (const SessionSummary& session : *sessions) {
    if (std::string why = WhyNotBrought(session); !why.empty()) {
      transfer.LeaveOut(session.key, std::move(why));
      continue;
    }
    Status status = transfer.Bring(session, [&]() -> Status {
      done = std::min(done + 1, all);  // more may come meanwhile
      return progress ? progress(done, all) : Status();
    });
    if (!status.ok()) return Error(status.WithContext(from.name()));
  }
  return transfer.Finish();
}

}  // namespace atlas
