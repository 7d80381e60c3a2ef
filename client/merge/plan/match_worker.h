// Matches submaps, one thread's: keeps what it prepared of the latest ones, and asks the work first
// whether that was done before.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <vector>

#include "client/merge/plan/merge_context.h"
#include "client/merge/plan/merge_session.h"
#include "core/alignment/submap_match.h"
#include "core/base/status.h"

namespace atlas {

class MatchWorker {
 public:
  // Both outlive it.
  MatchWorker(const std::vector<MergeSession>& sessions, const MergeContext& context)
      : sessions_(&sessions), context_(context) {}

  // Errors are those of the work.
  Result<SubmapMatch> Match(const SubmapRef& a, const SubmapRef& b, const Pose& T_a_b_start);
  // Of the places around a start that columns speak for the likeliest match.
  Result<SubmapMatch> Search(const SubmapRef& a,
                             const SubmapRef& b,
                             const Pose& T_a_b_start,
                             const SearchReach& reach);

 private:
  static constexpr std::size_t kKept = 56;  // some 10 MB each
  struct Prepared {
    SubmapName name;
    std::unique_ptr<const Submap> submap;
    std::unique_ptr<SubmapWindow> window;  // made when first asked for
  };

  const SubmapName& NameOf(const SubmapRef& ref) const { return At(*sessions_, ref).sketch.name; }
  Result<Prepared*> Load(const SubmapName& name);
  Result<SubmapWindow*> Prepare(const SubmapName& name);
  Result<SubmapMatch> MatchNow(const SubmapName& a, const SubmapName& b, const Pose& T_a_b_start);
  Result<SubmapMatch> SearchNow(const SubmapName& a,
                                const SubmapName& b,
                                const Pose& T_a_b_start,
                                const SearchReach& reach);

  const std::vector<MergeSession>* sessions_;
  MergeContext context_;
  std::list<Prepared> prepared_;  // the latest used first
};

}  // namespace atlas
