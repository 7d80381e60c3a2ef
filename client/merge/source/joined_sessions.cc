#include "client/merge/source/joined_sessions.h"

#include <utility>

#include "client/merge/source/session_transfer.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"

namespace atlas {

Result<JoinedSessions> JoinedSessions::Make(std::vector<std::unique_ptr<SessionSource>> sources) {
  if (sources.empty()) return Error(StatusCode::kInvalidArgument, "there is no atlas to merge");
  for (const auto& source : sources) {
    Status status = CheckTransfer(*source, sources.front()->profile());
    if (!status.ok()) return Error(std::move(status));
  }
  return JoinedSessions(std::move(sources));
}

Result<std::vector<SessionSummary>> JoinedSessions::ListSessions() {
  owners_.clear();
  std::map<SessionKey, SessionSummary> all;
  for (const auto& source : sources_) {
    auto sessions = source->ListSessions();
    if (!sessions) return Error(sessions.error().WithContext(source->name()));
    const bool is_first = source == sources_.front();
    for (SessionSummary& session : *sessions) {
      const bool is_brought = WhyNotBrought(session).empty();
      const auto known = all.find(session.key);
      if (is_first || is_brought) owners_[session.key].push_back(source.get());
      if (known != all.end()) {
        if (is_brought) known->second.keyframes += session.keyframes;
        continue;
      }
      if (!is_first && is_brought) session.state = "staged";
      all.emplace(session.key, std::move(session));
    }
  }
  std::vector<SessionSummary> list;
  list.reserve(all.size());
  for (auto& [key, session] : all) list.push_back(std::move(session));
  return list;
}

Result<SessionReading> JoinedSessions::ReadKeyframes(
    const SessionKey& session, const std::function<Status(SessionKeyframe)>& on_keyframe) {
  const auto owners = owners_.find(session);
  if (owners == owners_.end()) {
    return Error(StatusCode::kNotFound, StrCat("there is no session ", session));
  }
  std::map<std::uint32_t, std::uint64_t> read;  // whole ones: a hash of the content
  SessionReading all;
  for (SessionSource* source : owners->second) {
    auto reading = source->ReadKeyframes(session, [&](SessionKeyframe keyframe) -> Status {
      const auto before = read.find(keyframe.sequence);
      if (!keyframe.damage.empty()) {
        return before == read.end() ? on_keyframe(std::move(keyframe)) : Status();
      }
      const std::uint64_t hash = Hash64(keyframe.blob);
      if (before == read.end()) {
        read.emplace(keyframe.sequence, hash);
        return on_keyframe(std::move(keyframe));
      }
      if (before->second == hash) return {};
      return NameIsTaken(session, source->name(), owners->second.front()->name());
    });
    if (!reading) return Error(reading.error());
    if (source == sources_.front().get()) all.revision = reading->revision;
    all.damaged += reading->damaged;
  }
  all.keyframes = read.size() + all.damaged;
  return all;
}

}  // namespace atlas
