// What became of the staged sessions that merges left where they are, and whether it is worth
// trying again: only when something happened by which they might fare otherwise. One thread at a
// time.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "core/geometry/keyframe_key.h"

namespace atlas {

// What a merge may be about.
struct KnownSession {
  bool is_staged = false;              // it can be merged, and
  bool is_in_map = false;              // it is merged with; neither: it is retracted, damaged, ...
  bool is_closed = false;              // nobody uploads to it any more
  std::uint64_t changed_revision = 0;  // SessionSummary's

  friend bool operator==(const KnownSession&, const KnownSession&) = default;
};
using KnownSessions = std::map<SessionKey, KnownSession>;

// What a merge had before it and did, as revisions of the atlas.
struct MergeRevisions {
  std::uint64_t read = 0;     // when its sessions were read
  std::uint64_t applied = 0;  // after its batch; 0: there was none
};

class TriedSessions {
 public:
  // One of `known` that is staged met none of those that were merged with it.
  void MetNobody(const SessionKey& key, const KnownSessions& known, const MergeRevisions& merge);
  // One of `known` that is staged failed, merged alone with the map, or would do what is not to be
  // done unattended; `about` others of `known`, as they are there.
  void SetAside(const SessionKey& key,
                const KnownSessions& known,
                const std::set<SessionKey>& about);
  // One of `known` that is staged does not fit those in the map.
  void Refused(const SessionKey& key, const KnownSessions& known);

  // Which of `known` that are staged and closed are to be merged now. A session is tried once. It
  // is tried again when it has changed, and if it met nobody, when another one that is closed came
  // or changed since, other than by the batch of its own merge, or if it was set aside, when one
  // that it is about changed or went, or if it was refused, when one left the map. Whoever met
  // nobody comes along with others: they might meet.
  std::vector<SessionKey> WorthTrying(const KnownSessions& known) const;

  // Of those that `known` does not have nothing is kept.
  void ForgetOthers(const KnownSessions& known);

 private:
  struct Trial {
    std::uint64_t own_revision = 0;
    bool is_set_aside = false;                  // or refused
    MergeRevisions merge;                       // it met nobody
    std::map<SessionKey, std::uint64_t> about;  // it was set aside
    std::set<SessionKey> map;                   // it was refused
  };

  static bool IsOutdated(const SessionKey& key, const Trial& trial, const KnownSessions& known);

  std::map<SessionKey, Trial> trials_;
};

}  // namespace atlas
