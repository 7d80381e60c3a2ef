#include "client/merge/source/session_transfer.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "client/connection/keyframe_uploader.h"
#include "client/merge/source/profile_difference.h"
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
    // What is refused is this session's.
    return reading ? uploader_.Finish() : reading.error();
  }

  void LeaveOut(const SessionKey& key, std::string why) {
    report_.left_out.push_back({key, std::move(why)});
  }

  TransferReport Finish() {
    report_.duplicates = uploader_.totals().duplicates;
    return std::move(report_);
  }

 private:
  SessionSource& from_;
  KeyframeUploader uploader_;
  TransferReport report_;
};

// A session that was purged has a name, and takes none.
bool HasKeyframes(AtlasClient& atlas, const SessionKey& key) {
  const auto sessions = atlas.ListSessions();
  return sessions &&
         std::any_of(sessions->begin(), sessions->end(), [&](const SessionSummary& session) {
           return session.key == key && session.keyframes > 0;
         });
}

}  // namespace

std::string WhyNotBrought(const SessionSummary& session) {
  if (session.is_damaged) return StrCat("damaged: ", session.reason);
  return session.IsInMap() || session.state == "staged" ? "" : session.state;
}

Status CheckTransfer(const SessionSource& from, const MapProfile& to) {
  if (from.profile() == to) return {};
  return {StatusCode::kInvalidArgument,
          StrCat(from.name(), " has another map profile than the atlas that it is brought to (",
                 DifferenceOf(from.profile(), to), "): its keyframes cannot be fused there")};
}

Status NameIsTaken(const SessionKey& session, const std::string& source, const std::string& other) {
  return {
      StatusCode::kConflict,
      StrCat("session ", session, ": ", source, " has other keyframes under this name than ", other,
             ": another drive, or the same one ingested otherwise. In one of the two retract it "
             "(atlas session retract ",
             session,
             "), and it is not brought from there, or ingest it there under another name (atlas "
             "ingest --vehicle, --session)")};
}

const std::string& SessionTransfer::HolderOf(const SessionKey& session) const {
  const auto brought = brought_from_.find(session);
  return brought == brought_from_.end() ? to_name_ : brought->second;
}

Result<TransferReport> SessionTransfer::Bring(
    SessionSource& from, const std::function<Status(std::size_t done, std::size_t all)>& progress) {
  if (Status status = CheckTransfer(from, to_.profile()); !status.ok()) {
    return Error(std::move(status));
  }
  const auto sessions = from.ListSessions();
  if (!sessions) return Error(sessions.error());
  std::size_t all = 0;
  for (const SessionSummary& session : *sessions) {
    all += WhyNotBrought(session).empty() ? session.keyframes : 0;
  }
  std::size_t done = 0;
  Transfer transfer(from, to_);
  for (const SessionSummary& session : *sessions) {
    if (std::string why = WhyNotBrought(session); !why.empty()) {
      transfer.LeaveOut(session.key, std::move(why));
      continue;
    }
    Status status = transfer.Bring(session, [&]() -> Status {
      done = std::min(done + 1, all);  // more may come meanwhile
      return progress ? progress(done, all) : Status();
    });
    if (status.code() == StatusCode::kConflict && HasKeyframes(to_, session.key)) {
      return Error(NameIsTaken(session.key, from.name(), HolderOf(session.key)));
    }
    if (!status.ok()) return Error(status.WithContext(from.name()));
    brought_from_.emplace(session.key, from.name());
  }
  return transfer.Finish();
}

}  // namespace atlas
