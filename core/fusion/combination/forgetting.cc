#include "core/fusion/combination/forgetting.h"

#include <algorithm>

#include "core/base/small_sort.h"
#include "core/fusion/combination/bounded_choice.h"

namespace atlas {
namespace {

// Stretches that may go, or change, without a question: a pass or two.
constexpr std::size_t kSpareStretches = 3;

bool ComesBefore(const ForgottenMark& a, const ForgottenMark& b) {
  return a.is_strong != b.is_strong ? a.is_strong : a.last_time_ms > b.last_time_ms;
}

ForgottenMark MarkOf(const SegmentView& view, const MapProfile& profile) {
  return {view.last_time_ms, view.vehicle, BandOf(view, profile.band_mm), view.segment->is_strong};
}

void Add(const ForgottenMark& mark, std::vector<ForgottenMark>& marks) {
  const auto its = std::find_if(marks.begin(), marks.end(), [&](const ForgottenMark& other) {
    return other.vehicle == mark.vehicle && other.band == mark.band;
  });
  if (its == marks.end()) {
    marks.push_back(mark);
  } else if (ComesBefore(mark, *its)) {
    *its = mark;
  }
}

}  // namespace

void Forgetting::AddPresent(const SegmentView& view) {
  present_.push_back({MarkOf(view, profile_), view.stretch});
}

void Forgetting::SetPresent(std::span<const SegmentView> segments) {
  present_.clear();
  for (const SegmentView& view : segments) {
    AddPresent(view);
  }
}

// One that is as late as the mark is not taken to come before it.
void Forgetting::TallyBefore(const ForgottenMark& mark) {
  tallies_.clear();
  for (const Present& its : present_) {
    if (its.mark.band != mark.band || !ComesBefore(its.mark, mark)) {
      continue;
    }
    const auto tally = std::find_if(tallies_.begin(), tallies_.end(),
                                    [&](const Tally& t) { return t.stretch == its.stretch; });
    if (tally == tallies_.end()) {
      tallies_.push_back({its.stretch, its.mark.vehicle, 1});
    } else {
      ++tally->segments;
    }
  }
  SmallStableSort(tallies_.begin(), tallies_.end(),
                  [](const Tally& a, const Tally& b) { return a.segments > b.segments; });
}

bool Forgetting::IsVehicleFull(std::uint32_t vehicle, std::size_t spare) const {
  std::size_t segments = 0;
  for (const Tally& tally : tallies_) {
    if (tally.vehicle != vehicle) {
      continue;
    }
    if (spare > 0) {
      --spare;
    } else {
      segments += tally.segments;
    }
  }
  return segments >= profile_.band_vehicle_segments;
}

bool Forgetting::IsBandFull(std::size_t spare) const {
  const std::size_t limit = profile_.band_vehicle_segments;
  std::size_t needed = profile_.band_segments;
  std::size_t segments = 0;
  for (std::size_t i = 0; i < tallies_.size(); ++i) {
    const auto is_of_same = [&](const Tally& other) {
      return other.vehicle == tallies_[i].vehicle;
    };
    const auto end = tallies_.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::none_of(tallies_.begin(), end, is_of_same)) {
      std::size_t of_vehicle = 0;
      for (const Tally& tally : tallies_) {
        of_vehicle += is_of_same(tally) ? tally.segments : 0;
      }
      segments += std::min(limit, of_vehicle);
    }
    // More than what goes with the stretch where its vehicle has others.
    needed += i < spare ? std::min(limit, tallies_[i].segments) : 0;
  }
  return segments >= needed;
}

std::size_t Forgetting::MoveSpareToFront(std::span<const SegmentView> counting,
                                         std::span<SegmentView> rest,
                                         std::vector<ForgottenMark>& marks) {
  if (rest.empty() && marks.empty()) {
    return 0;
  }
  SetPresent(counting);
  before_.swap(marks);
  marks.clear();
  SmallStableSort(rest.begin(), rest.end(), IsChosenBefore);
  std::size_t spared = 0;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    ForgottenMark mark = MarkOf(rest[i], profile_);
    TallyBefore(mark);
    if (IsBandFull(kSpareStretches)) {
      mark.vehicle = ForgottenMark::kAnyVehicle;
    } else if (!IsVehicleFull(mark.vehicle, kSpareStretches)) {
      AddPresent(rest[i]);
      std::swap(rest[spared++], rest[i]);
      continue;
    }
    Add(mark, marks);
  }
  for (ForgottenMark mark : before_) {
    TallyBefore(mark);
    mark.vehicle = IsBandFull(kSpareStretches) ? ForgottenMark::kAnyVehicle : mark.vehicle;
    Add(mark, marks);
  }
  return spared;
}

bool Forgetting::MayCount(std::span<const ForgottenMark> marks,
                          std::span<const SegmentView> present) {
  SetPresent(present);
  return std::any_of(marks.begin(), marks.end(), [&](const ForgottenMark& mark) {
    TallyBefore(mark);
    return !IsVehicleFull(mark.vehicle, 0) && !IsBandFull(0);
  });
}

}  // namespace atlas
