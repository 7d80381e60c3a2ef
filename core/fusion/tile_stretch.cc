#include "core/fusion/tile_stretch.h"

#include "core/base/small_sort.h"

namespace atlas {

std::size_t TileStretch::bytes() const {
  return sizeof(*this) + frames.capacity() * sizeof(StretchMember) +
         times_ms.capacity() * sizeof(std::int64_t) + (open ? open->bytes() : 0);
}

void CollectOpen(std::size_t cell,
                 std::uint32_t place,
                 std::span<TileStretch> stretches,
                 std::vector<SegmentView>& segments) {
  StretchSurvey& open = *stretches[place].open;
  for (std::uint32_t i = open.First(cell); i != Segment::kNone; i = open.At(i).next) {
    segments.push_back(ViewOf(open.At(i), place, stretches));
  }
}

void SortByStretch(std::vector<SegmentView>& segments) {
  const auto is_before = [](const SegmentView& a, const SegmentView& b) {
    return a.stretch < b.stretch;
  };
  SmallStableSort(segments.begin(), segments.end(), is_before);
}

}  // namespace atlas
