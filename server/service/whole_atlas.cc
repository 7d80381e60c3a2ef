#include "server/service/whole_atlas.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

Result<std::uint64_t> WholeAtlas::CleanRevision(const Patience& patience) const {
  const auto clean = wait_.UntilCleanInTime(patience);
  if (!clean) {
    return Error(clean.error());
  }
  if (!clean->damage.ok()) {
    return Error(clean->damage);
  }
  return clean->revision;
}

Result<AtlasDigest> WholeAtlas::Digest(const Patience& patience) const {
  const auto check_stop = wait_.Check(patience, "the digest was not computed in time");
  while (true) {
    const auto revision = CleanRevision(patience);
    if (!revision) {
      return Error(revision.error());
    }
    auto digest = ComputeDigest(store_, check_stop);
    if (!digest) {
      return Error(digest.error());
    }
    const auto after = store_.ReadDirtyState();
    if (!after) {
      return Error(after.error());
    }
    if (after->revision == *revision) {
      digest->revision = *revision;
      return digest;
    }
    if (patience.is_over()) {
      return Error(StatusCode::kTimeout, "the atlas changes while its digest is computed");
    }
  }
}

Result<VerifyReport> WholeAtlas::Verify(const VerifyRequest& request,
                                        const Patience& patience) const {
  if (!request.repair) {
    return VerifyInTime(request.rebuild, patience);
  }
  AtlasVerifier::Options options;
  options.request = request;
  options.check_stop = wait_.Check(patience, "the atlas was not repaired in time");
  auto repaired = AtlasVerifier(store_, options).Run();
  changes_.Notify();  // what was marked can be built
  if (!repaired) {
    return repaired;
  }
  if (const auto clean = UntilCleanOrFull(patience); !clean) {
    return Error(clean.error());
  }
  auto left = VerifyInTime(request.rebuild, patience);
  if (left) {
    left->restored = repaired->restored;
    left->given_up = repaired->given_up;
    left->findings.insert(left->findings.begin(), repaired->findings.begin(),
                          repaired->findings.end());
  }
  return left;
}

Result<WaitOutcome> WholeAtlas::UntilCleanOrFull(const Patience& patience) const {
  constexpr std::chrono::seconds kSlice(2);  // workers try once a second
  std::uint64_t left = std::numeric_limits<std::uint64_t>::max();
  while (true) {
    const auto begin = std::chrono::steady_clock::now();
    const Patience slice{std::min(patience.deadline, begin + kSlice), patience.stop};
    auto clean = wait_.UntilClean(slice);
    if (!clean || !clean->is_timed_out) {
      return clean;
    }
    if (patience.is_over()) {
      return wait_.UntilCleanInTime(patience);
    }
    const auto refusal = store_.ReadWriteFigures().last_refusal;
    if (refusal && refusal->when >= begin && clean->dirty_tiles >= left) {
      return Error(refusal->why.WithContext(
          StrCat(clean->dirty_tiles, " tiles are to be fused, and cannot be written")));
    }
    left = clean->dirty_tiles;
  }
}

Result<VerifyReport> WholeAtlas::VerifyInTime(bool rebuild, const Patience& patience) const {
  AtlasVerifier::Options options;
  options.request.rebuild = rebuild;
  options.check_stop = wait_.Check(patience, "the atlas was not verified in time");
  while (true) {
    std::uint64_t clean_revision = 0;
    if (rebuild) {
      const auto clean = UntilCleanOrFull(patience);
      if (!clean) {
        return Error(clean.error());
      }
      clean_revision = clean->revision;
    }
    const auto before = store_.ReadCounts();
    if (!before) {
      return Error(before.error());
    }
    auto report = AtlasVerifier(store_, options).Run();
    if (!report) {
      return Error(report.error());
    }
    const auto after = store_.ReadCounts();
    if (!after) {
      return Error(after.error());
    }
    report->revision = after->revision;
    changes_.Notify();  // tiles that are damaged were marked
    // Its own marks change nothing where tiles cannot be fused: they would be found for ever.
    // A tile that changed between being read and being rebuilt is no mismatch, and a keyframe that
    // was dropped since it was listed no damage: look again.
    const bool is_in_doubt =
        (rebuild && report->mismatched > 0 && after->revision != clean_revision + report->marks) ||
        (report->damaged > 0 && after->compacted != before->compacted);
    if (!is_in_doubt) {
      return report;
    }
    if (patience.is_over()) {
      return Error(StatusCode::kTimeout, "the atlas changes while it is verified");
    }
  }
}

Result<CompactionReport> WholeAtlas::Compact(const CompactionRequest& request,
                                             const Patience& patience) {
  if (Status status = CheckCompaction(request, store_.identity().profile); !status.ok()) {
    return Error(std::move(status));
  }
  const std::unique_lock only_one(compacting_, std::try_to_lock);
  if (!only_one) {
    return Error(StatusCode::kUnavailable, "another compaction is under way");
  }
  const std::uint64_t revision = store_.revision();
  if (Status status = wait_.ForRevision(revision, patience); !status.ok()) {
    return Error(std::move(status));
  }
  const auto check_stop = wait_.Check(patience, "the atlas was not compacted in time");
  auto report = CompactAt(store_, revision, request, check_stop);
  changes_.Notify();
  return report;
}

}  // namespace atlas
