#include "core/fusion/combination/bounded_guards.h"

#include <algorithm>
#include <cassert>

#include "core/base/integer_math.h"
#include "core/base/small_sort.h"

namespace atlas {
namespace {

class Bands {
 public:
  explicit Bands(const MapProfile& profile) : band_mm_(profile.band_mm) {}

  bool AreSame(const SegmentView& a, const SegmentView& b) const { return Of(a) == Of(b); }

 private:
  std::int64_t Of(const SegmentView& view) const {
    return FloorDiv(view.segment->altitude_mm, band_mm_);
  }

  std::int64_t band_mm_;
};

bool ComesBefore(const SegmentView& a, const SegmentView& b) {
  return a.segment->is_strong != b.segment->is_strong ? a.segment->is_strong : WasSeenEarlier(b, a);
}

// Those before `view` in its band.
template <typename Visit>
void ForEachBefore(const SegmentView& view,
                   std::span<const SegmentView> segments,
                   const Bands& bands,
                   Visit&& visit) {
  for (const SegmentView& other : segments) {
    if (bands.AreSame(other, view) && ComesBefore(other, view)) {
      visit(other);
    }
  }
}

void SpreadGuard(const SegmentView& guard, std::span<const SegmentView> kept, const Bands& bands) {
  if (!guard.segment->guards_vehicle && !guard.segment->guards_band) {
    return;
  }
  ForEachBefore(guard, kept, bands, [&](const SegmentView& other) {
    if (guard.segment->guards_band) {
      other.segment->guards_band = true;
    }
    if (guard.segment->guards_vehicle && other.vehicle == guard.vehicle) {
      other.segment->guards_vehicle = true;
    }
  });
}

// How many of `segments` a choice would take for which `is_one` holds, without the band's limit.
template <typename IsOne>
std::size_t CountLimited(std::span<const SegmentView> segments,
                         std::size_t limit_of_vehicle,
                         const IsOne& is_one) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (is_one(segments[i])) {
      const auto before = segments.first(i);
      count += static_cast<std::size_t>(
                   std::count_if(before.begin(), before.end(),
                                 [&](const SegmentView& other) {
                                   return other.vehicle == segments[i].vehicle && is_one(other);
                                 })) < limit_of_vehicle
                   ? 1u
                   : 0u;
    }
  }
  return count;
}

}  // namespace

void MarkGuards(std::span<const SegmentView> kept,
                std::span<const SegmentView> forgotten,
                const MapProfile& profile) {
  const Bands bands(profile);
  for (const SegmentView& view : forgotten) {
    std::size_t of_vehicle = 0;
    ForEachBefore(view, kept, bands, [&](const SegmentView& other) {
      of_vehicle += other.vehicle == view.vehicle ? 1u : 0u;
    });
    const bool is_vehicle_full = of_vehicle >= profile.band_vehicle_segments;
    ForEachBefore(view, kept, bands, [&](const SegmentView& other) {
      if (!is_vehicle_full) {
        other.segment->guards_band = true;
      } else if (other.vehicle == view.vehicle) {
        other.segment->guards_vehicle = true;
      }
    });
    SpreadGuard(view, kept, bands);
  }
  for (const SegmentView& view : kept) {
    SpreadGuard(view, kept, bands);
  }
}

bool MayCountAgain(std::span<const SegmentView> removed,
                   std::span<const SegmentView> left,
                   const MapProfile& profile) {
  const Bands bands(profile);
  const std::size_t of_vehicle = profile.band_vehicle_segments;
  for (const SegmentView& gone : removed) {
    const auto is_vehicle_guard = [&](const SegmentView& other) {
      return other.segment->guards_vehicle && other.vehicle == gone.vehicle &&
             bands.AreSame(other, gone);
    };
    const auto is_band_guard = [&](const SegmentView& other) {
      return other.segment->guards_band && bands.AreSame(other, gone);
    };
    if ((gone.segment->guards_vehicle &&
         CountLimited(left, of_vehicle, is_vehicle_guard) < of_vehicle) ||
        (gone.segment->guards_band &&
         CountLimited(left, of_vehicle, is_band_guard) < profile.band_segments)) {
      return true;
    }
  }
  return false;
}

std::size_t MoveSpareToFront(std::span<SegmentView> forgotten,
                             std::size_t spare,
                             const MapProfile& profile) {
  const Bands bands(profile);
  SmallStableSort(forgotten.begin(), forgotten.end(), ComesBefore);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < forgotten.size(); ++i) {
    const auto before = forgotten.first(kept);
    const auto alike = std::count_if(before.begin(), before.end(), [&](const SegmentView& other) {
      return other.vehicle == forgotten[i].vehicle && bands.AreSame(other, forgotten[i]);
    });
    if (static_cast<std::size_t>(alike) < spare) {
      std::swap(forgotten[kept++], forgotten[i]);
    }
  }
  return kept;
}

}  // namespace atlas
