// Matches submaps, one thread's: keeps what it prepared of the latest ones.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <vector>

#include "client/merge/plan/merge_session.h"
#include "core/alignment/submap_match.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

class MatchWorker {
 public:
  // All outlive it.
  MatchWorker(const std::vector<MergeSession>& sessions,
              const MapProfile& profile,
              const MatchOptions& options)
      : sessions_(&sessions), profile_(&profile), options_(&options) {}

  // Errors are those of the submaps' tiles.
  Result<SubmapMatch> Match(const SubmapRef& a, const SubmapRef& b, const Pose& T_a_b_start);
  // Of the places around a start that columns speak for the likeliest match.
  Result<SubmapMatch> Search(const SubmapRef& a,
                             const SubmapRef& b,
                             const Pose& T_a_b_start,
                             const SearchReach& reach);

 private:
  static constexpr std::size_t kKept = 24;  // some 10 MB each
  struct Prepared {
    SubmapRef ref;
    std::unique_ptr<SubmapWindow> window;
  };

  Result<SubmapWindow*> Prepare(const SubmapRef& ref);

  const std::vector<MergeSession>* sessions_;
  const MapProfile* profile_;
  const MatchOptions* options_;
  std::list<Prepared> prepared_;  // the latest used first
};

}  // namespace atlas
