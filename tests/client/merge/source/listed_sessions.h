// Sessions in memory, to be read as those of a daemon.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "client/merge/source/session_source.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {

class ListedSessions : public SessionSource {
 public:
  struct Session {
    SessionSummary summary;
    std::vector<SessionKeyframe> keyframes;
    std::uint64_t revision = 0;  // when it is read
  };

  // With `keyframes` that saw nothing, a metre apart along x from `x_m` on.
  Session& Add(const SessionKey& key,
               const std::string& state,
               std::uint32_t keyframes = 0,
               double x_m = 0.0) {
    Session& session = sessions.emplace_back();
    session.summary.key = key;
    session.summary.state = state;
    session.summary.keyframes = keyframes;
    session.revision = 100 - sessions.size();
    for (std::uint32_t i = 0; i < keyframes; ++i) {
      SessionKeyframe& keyframe = session.keyframes.emplace_back();
      keyframe.sequence = 10 + i;
      keyframe.time_ms = 1'000 + i;
      keyframe.T_world_sensor.x_um = static_cast<std::int64_t>(1e6 * (x_m + i));
      keyframe.blob = EncodeKeyframe(BlankKeyframe(map_profile, 4));
    }
    return session;
  }

  std::string name() const override { return list_name; }
  const MapProfile& profile() const override { return map_profile; }
  Result<std::vector<SessionSummary>> ListSessions() override {
    std::vector<SessionSummary> summaries;
    for (const Session& session : sessions) summaries.push_back(session.summary);
    return summaries;
  }
  Result<SessionReading> ReadKeyframes(
      const SessionKey& key, const std::function<Status(SessionKeyframe)>& on_keyframe) override {
    for (const Session& session : sessions) {
      if (session.summary.key != key) continue;
      for (const SessionKeyframe& keyframe : session.keyframes) {
        if (Status status = on_keyframe(keyframe); !status.ok()) return Error(std::move(status));
      }
      return SessionReading{session.keyframes.size(), 0, session.revision};
    }
    return Error(StatusCode::kNotFound, "no such session");
  }

  std::vector<Session> sessions;
  MapProfile map_profile;
  std::string list_name = "a list";
};

}  // namespace atlas::testing
