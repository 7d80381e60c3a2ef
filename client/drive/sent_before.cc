#include "client/drive/sent_before.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>

namespace atlas {
namespace {

// Of a session, as it would be with ours alone up to the last sequence number that it has.
struct Expected {
  std::uint64_t keyframes = 0;
  std::int64_t first_time_ms = std::numeric_limits<std::int64_t>::max();
  std::int64_t last_time_ms = std::numeric_limits<std::int64_t>::min();

  void Add(std::int64_t time_ms) {
    ++keyframes;
    first_time_ms = std::min(first_time_ms, time_ms);
    last_time_ms = std::max(last_time_ms, time_ms);
  }
  bool IsOf(const SessionSummary& session) const {
    return keyframes == session.keyframes + session.compacted &&
           first_time_ms == session.first_time_ms && last_time_ms == session.last_time_ms;
  }
};

}  // namespace

std::vector<std::size_t> FindThere(std::span<const PlannedKeyframe> planned,
                                   std::span<const SessionSummary> sessions) {
  std::set<KeyframeKey> there;
  for (const SessionSummary& session : sessions) {
    if (session.keyframes + session.compacted > 0) {
      there.insert({session.key, session.last_sequence});
    }
  }
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    if (there.contains(planned[i].key)) found.push_back(i);
  }
  return found;
}

std::size_t CountSentBefore(std::span<const PlannedKeyframe> planned,
                            std::span<const SessionSummary> sessions) {
  std::map<SessionKey, const SessionSummary*> known;
  for (const SessionSummary& session : sessions) {
    known[session.key] = &session;
  }
  const auto session_with = [&known](const KeyframeKey& key) -> const SessionSummary* {
    const auto found = known.find(key.session);
    const bool is_within = found != known.end() && key.sequence <= found->second->last_sequence;
    return is_within ? found->second : nullptr;
  };
  std::map<SessionKey, Expected> expected;
  for (const PlannedKeyframe& keyframe : planned) {
    if (session_with(keyframe.key) != nullptr) expected[keyframe.key.session].Add(keyframe.time_ms);
  }
  const auto first_missing =
      std::find_if(planned.begin(), planned.end(), [&](const PlannedKeyframe& keyframe) {
        const SessionSummary* session = session_with(keyframe.key);
        return session == nullptr || !expected.at(keyframe.key.session).IsOf(*session);
      });
  if (first_missing == planned.end()) return 0;
  return static_cast<std::size_t>(first_missing - planned.begin());
}

}  // namespace atlas
