#include "core/fusion/combination/bounded_guards.h"

#include <algorithm>

#include "core/base/small_sort.h"
#include "core/fusion/combination/bounded_choice.h"

namespace atlas {
namespace {

bool AreInOneBand(const SegmentView& a, const SegmentView& b, const MapProfile& profile) {
  return BandOf(a, profile.band_mm) == BandOf(b, profile.band_mm);
}

// Those chosen before `view` in its band.
template <typename Visit>
void ForEachBefore(const SegmentView& view,
                   std::span<const SegmentView> segments,
                   const MapProfile& profile,
                   Visit&& visit) {
  for (const SegmentView& other : segments) {
    if (AreInOneBand(other, view, profile) && IsChosenBefore(other, view)) {
      visit(other);
    }
  }
}

void SpreadGuard(const SegmentView& guard,
                 std::span<const SegmentView> kept,
                 const MapProfile& profile) {
  if (!guard.segment->guards_vehicle && !guard.segment->guards_band) {
    return;
  }
  ForEachBefore(guard, kept, profile, [&](const SegmentView& other) {
    if (guard.segment->guards_band) {
      other.segment->guards_band = true;
    }
    if (guard.segment->guards_vehicle && other.vehicle == guard.vehicle) {
      other.segment->guards_vehicle = true;
    }
  });
}

// How many of the segments that are guards can count in their band, as far as their vehicles'
// limit goes.
template <typename IsGuard>
std::size_t CountGuards(std::span<const SegmentView> segments,
                        std::size_t limit_of_vehicle,
                        const IsGuard& is_guard) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (!is_guard(segments[i])) {
      continue;
    }
    const auto is_another = [&](const SegmentView& other) {
      return other.vehicle == segments[i].vehicle && is_guard(other);
    };
    const auto before = segments.first(i);
    const auto of_vehicle = std::count_if(before.begin(), before.end(), is_another);
    count += static_cast<std::size_t>(of_vehicle) < limit_of_vehicle ? 1u : 0u;
  }
  return count;
}

}  // namespace

void MarkGuards(std::span<const SegmentView> kept,
                std::span<const SegmentView> forgotten,
                const MapProfile& profile) {
  for (const SegmentView& view : forgotten) {
    std::size_t of_vehicle = 0;
    ForEachBefore(view, kept, profile, [&](const SegmentView& other) {
      of_vehicle += other.vehicle == view.vehicle ? 1u : 0u;
    });
    const bool is_vehicle_full = of_vehicle >= profile.band_vehicle_segments;
    ForEachBefore(view, kept, profile, [&](const SegmentView& other) {
      if (!is_vehicle_full) {
        other.segment->guards_band = true;
      } else if (other.vehicle == view.vehicle) {
        other.segment->guards_vehicle = true;
      }
    });
    SpreadGuard(view, kept, profile);
  }
  for (const SegmentView& view : kept) {
    SpreadGuard(view, kept, profile);
  }
}

bool MayCountAgain(std::span<const SegmentView> removed,
                   std::span<const SegmentView> left,
                   const MapProfile& profile) {
  const std::size_t of_vehicle = profile.band_vehicle_segments;
  for (const SegmentView& gone : removed) {
    const auto is_vehicle_guard = [&](const SegmentView& other) {
      return other.segment->guards_vehicle && other.vehicle == gone.vehicle &&
             AreInOneBand(other, gone, profile);
    };
    const auto is_band_guard = [&](const SegmentView& other) {
      return other.segment->guards_band && AreInOneBand(other, gone, profile);
    };
    if ((gone.segment->guards_vehicle &&
         CountGuards(left, of_vehicle, is_vehicle_guard) < of_vehicle) ||
        (gone.segment->guards_band &&
         CountGuards(left, of_vehicle, is_band_guard) < profile.band_segments)) {
      return true;
    }
  }
  return false;
}

std::size_t MoveSpareToFront(std::span<SegmentView> forgotten,
                             std::size_t spare,
                             const MapProfile& profile) {
  SmallStableSort(forgotten.begin(), forgotten.end(), IsChosenBefore);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < forgotten.size(); ++i) {
    const auto before = forgotten.first(kept);
    const auto alike = std::count_if(before.begin(), before.end(), [&](const SegmentView& other) {
      return other.vehicle == forgotten[i].vehicle && AreInOneBand(other, forgotten[i], profile);
    });
    if (static_cast<std::size_t>(alike) < spare) {
      std::swap(forgotten[kept++], forgotten[i]);
    }
  }
  return kept;
}

}  // namespace atlas
