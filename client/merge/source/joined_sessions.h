// Several sources as one: what the first of them would hold if the sessions of the others were
// brought to it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/merge/source/session_source.h"

namespace atlas {

class JoinedSessions : public SessionSource {
 public:
  // Of those behind the first, sessions in their maps or staged there, as SessionTransfer takes
  // them. The first one's are as they are, and get those of their keyframes that only others have.
  // kInvalidArgument: one has another map profile than the first, which it needs.
  static Result<JoinedSessions> Make(std::vector<std::unique_ptr<SessionSource>> sources);

  std::string name() const override { return sources_.front()->name(); }
  const MapProfile& profile() const override { return sources_.front()->profile(); }
  // Keyframes that several have count several times.
  Result<std::vector<SessionSummary>> ListSessions() override;
  // In any order. kConflict: two sources have different keyframes under one number. The revision is
  // the first source's; 0: it does not have the session.
  Result<SessionReading> ReadKeyframes(
      const SessionKey& session,
      const std::function<Status(SessionKeyframe)>& on_keyframe) override;

 private:
  explicit JoinedSessions(std::vector<std::unique_ptr<SessionSource>> sources)
      : sources_(std::move(sources)) {}

  std::vector<std::unique_ptr<SessionSource>> sources_;
  std::map<SessionKey, std::vector<SessionSource*>> owners_;  // as the last list had them
};

}  // namespace atlas
