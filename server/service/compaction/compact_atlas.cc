#include "server/service/compaction/compact_atlas.h"

#include <utility>

#include "core/base/str_cat.h"
#include "server/service/compaction/compaction_planner.h"
#include "server/service/upload_check.h"
#include "server/store/await.h"

namespace atlas {
namespace {

// After each the plan has less that can change. The first follows a search of the whole atlas, the
// others only look which tiles changed since.
constexpr int kAttempts = 10;

}  // namespace

Status CheckCompaction(const CompactionRequest& request, const MapProfile& profile) {
  if (profile.preset != FusionPreset::kBounded) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("compaction: this atlas has preset ", FusionPresetName(profile.preset),
                         ", in which every keyframe counts; expected bounded"));
  }
  if (request.before_ms < 0) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("compaction: before ", request.before_ms, " ms, expected 0 or more"));
  }
  return CheckAuthor(request.author);
}

Result<CompactionReport> CompactAt(AtlasStore& store,
                                   std::uint64_t revision,
                                   const CompactionRequest& request,
                                   const std::function<Status()>& check_stop) {
  CompactionPlanner::Options options;
  options.revision = revision;
  options.from_ms = request.from_ms;
  options.before_ms = request.before_ms;
  options.check_stop = check_stop;
  CompactionPlanner planner(store, std::move(options));
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    auto plan = planner.Run();
    if (!plan) {
      return Error(plan.error());
    }
    if (Status status = check_stop(); !status.ok()) {
      return Error(std::move(status));
    }
    Compaction compaction{revision, request.before_ms, std::move(plan->dropped), request.author};
    const auto stored = Await<CompactionResult>(
        [&](auto done) { store.Compact(std::move(compaction), std::move(done)); });
    if (stored) {
      return CompactionReport{*stored, plan->tiles_checked};
    }
    if (stored.error().code() != StatusCode::kConflict) {
      return Error(stored.error());
    }
  }
  return Error(StatusCode::kUnavailable,
               "the places that could be compacted keep changing: try again later");
}

}  // namespace atlas
