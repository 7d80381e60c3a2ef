#include "core/localization/monitor/segment_evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace atlas {
namespace {

void Count(std::uint16_t& counter, std::uint32_t times = 1) {
  constexpr std::uint32_t kMost = std::numeric_limits<std::uint16_t>::max();
  counter = static_cast<std::uint16_t>(std::min(kMost, counter + times));
}

// Log of how much likelier so many hits and passes are if something stands there than if not.
double LogThere(const EvidenceSum& sum, double hit_if_not, const EvidenceOptions& options) {
  return sum.hits * std::log(options.hit_if_there / hit_if_not) +
         sum.passes * std::log((1.0 - options.hit_if_there) / (1.0 - hit_if_not));
}

}  // namespace

std::string_view ContradictionKindName(ContradictionKind kind) {
  switch (kind) {
    case ContradictionKind::kAppeared:
      return "appeared";
    case ContradictionKind::kVanished:
      return "vanished";
    case ContradictionKind::kMoving:
      return "moving";
  }
  return "appeared";
}

void OccupiedEvidence::Add(const SegmentSight& sight, std::uint8_t halves, std::uint32_t scan) {
  if (!sight.is_hit && (sight.passed & halves) == 0) {
    return;
  }
  if (hits_ + lower_ + upper_ == 0) {
    first_scan_ = scan;
  }
  last_scan_ = scan;
  if (sight.is_hit) {
    Count(hits_);
    return;
  }
  Count(lower_, (sight.passed & kLowerHalf) != 0 ? 1 : 0);
  Count(upper_, (sight.passed & kUpperHalf) != 0 ? 1 : 0);
}

std::optional<Verdict> OccupiedEvidence::Judge(std::uint8_t halves,
                                               const EvidenceOptions& options) const {
  // Rays of few channels pass one half or the other.
  const bool are_both = halves == (kLowerHalf | kUpperHalf);
  const std::uint32_t passes = are_both ? (std::uint32_t{lower_} + upper_) / 2 : upper_;
  const std::uint32_t least = are_both ? std::min(lower_, upper_) : upper_;
  const double score = -LogThere({hits_, passes}, options.hit_if_not, options);
  if (least < options.min_half_passes || score < options.min_vanished_score) {
    return std::nullopt;
  }
  return Verdict{ContradictionKind::kVanished, hits_, passes, first_scan_, last_scan_, score};
}

void FreeEvidence::AddHit(std::uint8_t halves, std::uint32_t scan) {
  halves_ |= halves;
  if (hits_ > 0 && last_hit_ == scan) {
    return;
  }
  if (hits_ == 0) {
    first_scan_ = scan;
  }
  Count(hits_);
  Count(passes_meanwhile_, passes_since_);
  passes_since_ = 0;
  last_hit_ = scan;
  last_scan_ = scan;
}

void FreeEvidence::AddPass(const SegmentSight& sight, std::uint32_t scan) {
  if (sight.is_hit || last_hit_ == scan || (halves_ & ~sight.passed) != 0) {
    return;
  }
  Count(passes_since_);
  last_scan_ = scan;
}

std::optional<Verdict> FreeEvidence::Judge(const EvidenceSum& around,
                                           const PlaceContext& context,
                                           const EvidenceOptions& options) const {
  const double hit_if_not =
      context.is_beside_structure ? options.hit_if_not_beside : options.hit_if_not;
  Verdict verdict{ContradictionKind::kAppeared, hits_, sum().passes, first_scan_, last_scan_, 0.0};
  const double there = LogThere({hits_, passes_meanwhile_}, hit_if_not, options);
  const double gone = -LogThere({0, passes_since_}, hit_if_not, options);
  const bool is_over = there >= options.min_there_score && gone >= options.min_gone_score &&
                       passes_meanwhile_ <= options.max_flicker * hits_;
  if (is_over || (context.is_driven && around.hits >= options.min_driven_hits)) {
    verdict.kind = ContradictionKind::kMoving;
    verdict.score = there + gone;
    return verdict;
  }
  verdict.score = LogThere(around, hit_if_not, options);
  if (context.is_driven || hits_ < options.min_appeared_hits ||
      verdict.score < options.min_appeared_score) {
    return std::nullopt;
  }
  return verdict;
}

}  // namespace atlas
