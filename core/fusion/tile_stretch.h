// A stretch of a session beside the others of its tile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/bytes.h"
#include "core/fusion/segment/segment_view.h"
#include "core/fusion/stretch_plan.h"
#include "core/fusion/survey/stretch_survey.h"

namespace atlas {

// It is open while it grows, and has a survey of its own; later its segments are settled, among
// those of the others.
struct TileStretch {
  SessionKey key;
  std::uint32_t number = 0;   // StretchNumber's
  std::uint32_t session = 0;  // equal for equal keys, rising
  std::uint32_t vehicle = 0;  // the tile's number of its name
  std::vector<StretchMember> frames;
  std::vector<std::int64_t> times_ms;  // of the frames: they are looked up for every segment
  std::optional<StretchSurvey> open;   // else settled
  bool has_forgotten = false;          // some of its segments are gone
  std::uint32_t used = 0;              // segments that are part of a layer
  std::uint32_t grown_at = 0;          // the tile's count of changes then
  std::int64_t tile_time_ms = 0;       // of the tile's latest keyframe then

  std::size_t bytes() const;
  // To be loaded by the same build again.
  void Save(ByteWriter& out) const;
  // Of the tile `id`, packed. If there is none, in.ok() is false.
  static TileStretch Load(ByteReader& in, const TileId& id, const MapProfile& profile);
};

// A segment of the stretch at `place`.
inline SegmentView ViewOf(Segment& segment,
                          std::uint32_t place,
                          std::span<const TileStretch> stretches) {
  const TileStretch& its = stretches[place];
  return {
      .segment = &segment,
      .last_time_ms = its.times_ms[segment.last_frame],
      .driven_ms = segment.driven_frame == Segment::kNone ? 0 : its.times_ms[segment.driven_frame],
      .stretch = place,
      .session = its.session,
      .vehicle = its.vehicle};
}

// Appends a cell's segments of the open stretch at `place`.
void CollectOpen(std::size_t cell,
                 std::uint32_t place,
                 std::span<TileStretch> stretches,
                 std::vector<SegmentView>& segments);

// Into canonical order; those of a stretch stay in theirs.
void SortByStretch(std::vector<SegmentView>& segments);

// Says whether a segment is part of a layer. Most stay what they were: what is not written is not
// to be carried back to memory.
inline void SetUsed(const SegmentView& view, bool is_used, std::span<TileStretch> stretches) {
  if (view.segment->is_used != is_used) {
    std::uint32_t& used = stretches[view.stretch].used;
    used = is_used ? used + 1 : used - 1;
    view.segment->is_used = is_used;
  }
}

}  // namespace atlas
