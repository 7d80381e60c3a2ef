#include "client/merge/serve/tried_sessions.h"

#include <algorithm>
#include <utility>

namespace atlas {
namespace {

bool HasAnyChanged(const std::map<SessionKey, std::uint64_t>& about, const KnownSessions& known) {
  return std::any_of(about.begin(), about.end(), [&](const auto& one) {
    const auto now = known.find(one.first);
    // One that is uploaded to is looked at when that has ended.
    return now == known.end() ||
           (now->second.is_closed && now->second.changed_revision != one.second);
  });
}

bool HasAnyCome(const SessionKey& key, const MergeRevisions& merge, const KnownSessions& known) {
  return std::any_of(known.begin(), known.end(), [&](const auto& other) {
    const KnownSession& now = other.second;
    return other.first != key && now.is_closed && (now.is_staged || now.is_in_map) &&
           now.changed_revision > merge.read && now.changed_revision != merge.applied;
  });
}

bool HasAnyLeft(const std::set<SessionKey>& map, const KnownSessions& known) {
  return std::any_of(map.begin(), map.end(), [&](const SessionKey& key) {
    const auto now = known.find(key);
    return now == known.end() || !now->second.is_in_map;
  });
}

bool IsAllOfTheMapGrowing(const KnownSessions& known) {
  bool is_any = false;
  for (const auto& [key, session] : known) {
    if (!session.is_in_map) continue;
    if (session.is_closed) return false;
    is_any = true;
  }
  return is_any;
}

}  // namespace

void TriedSessions::MetNobody(const SessionKey& key,
                              const KnownSessions& known,
                              const MergeRevisions& merge) {
  trials_[key] = {known.at(key).changed_revision, false, merge, {}, {}};
}

void TriedSessions::SetAside(const SessionKey& key,
                             const KnownSessions& known,
                             const std::set<SessionKey>& about) {
  Trial trial{known.at(key).changed_revision, true, {}, {}, {}};
  for (const SessionKey& one : about) {
    trial.about.emplace(one, known.at(one).changed_revision);
  }
  trials_[key] = std::move(trial);
}

void TriedSessions::Refused(const SessionKey& key, const KnownSessions& known) {
  Trial trial{known.at(key).changed_revision, true, {}, {}, {}};
  for (const auto& [other, session] : known) {
    if (session.is_in_map) trial.map.insert(other);
  }
  trials_[key] = std::move(trial);
}

bool TriedSessions::IsOutdated(const SessionKey& key,
                               const Trial& trial,
                               const KnownSessions& known) {
  if (trial.own_revision != known.at(key).changed_revision) return true;
  return trial.is_set_aside ? HasAnyChanged(trial.about, known) || HasAnyLeft(trial.map, known)
                            : HasAnyCome(key, trial.merge, known);
}

std::vector<SessionKey> TriedSessions::WorthTrying(const KnownSessions& known) const {
  std::vector<SessionKey> worth;
  if (IsAllOfTheMapGrowing(known)) return worth;
  bool is_any_new = false;
  for (const auto& [key, session] : known) {
    if (!session.is_staged || !session.is_closed) continue;
    const auto trial = trials_.find(key);
    const bool is_new = trial == trials_.end() || IsOutdated(key, trial->second, known);
    is_any_new = is_any_new || is_new;
    if (is_new || !trial->second.is_set_aside) worth.push_back(key);
  }
  if (!is_any_new) worth.clear();
  return worth;
}

void TriedSessions::ForgetOthers(const KnownSessions& known) {
  std::erase_if(trials_, [&](const auto& trial) { return !known.contains(trial.first); });
}

}  // namespace atlas
