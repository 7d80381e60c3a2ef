// What the settled stretches of a tile saw.
//
// In preset bounded these are the segments that count. What counts no more is set aside,
// compressed, and in the end forgotten but for a mark (core/fusion/combination/forgetting.h),
// so that the size does not grow with the passes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/bytes.h"
#include "core/fusion/combination/bounded_choice.h"
#include "core/fusion/combination/forgetting.h"
#include "core/fusion/survey/cell_marks.h"
#include "core/fusion/survey/cell_set.h"
#include "core/fusion/survey/settled_segments.h"
#include "core/fusion/tile_stretch.h"

namespace atlas {

// Stretches are known by their places among the tile's, in canonical order; cells row by row.
class SettledStretches {
 public:
  static constexpr std::uint32_t kGone = SettledSegments::kGone;

  // Appends a cell's segments.
  void Collect(std::size_t cell,
               std::span<const TileStretch> stretches,
               std::vector<SegmentView>& segments);

  std::span<Segment> Segments(std::size_t cell) { return settled_.Segments(cell); }
  std::span<const std::uint32_t> Places(std::size_t cell) const { return settled_.Stretches(cell); }

  // Takes the segments of `settling`, open ones, and closes them.
  void Settle(std::span<const std::uint32_t> settling,
              std::span<TileStretch> stretches,
              const MapProfile& profile);

  // To be called before any of them leaves; `is_staying`, by place, says which do not. Settles
  // again what was set aside: it may count now. Says whether what was forgotten may count, too:
  // then all of it must be surveyed. Open ones keep nothing out: they change without a question.
  bool PrepareToLose(const std::vector<bool>& is_staying,
                     std::span<const TileStretch> stretches,
                     const MapProfile& profile);
  // Puts the segments of the stretch at `place`, about to leave, into `survey`, which is empty.
  void CopyTo(std::uint32_t place, StretchSurvey& survey) const { settled_.CopyTo(place, survey); }
  // The stretch at place i is at places[i] from now on, or leaves if that is kGone: the cells that
  // it saw go into `touched`.
  void Renumber(std::span<const std::uint32_t> places, CellSet& touched);

  std::size_t bytes() const { return settled_.bytes() + spare_.bytes() + marks_.bytes(); }
  // As StretchSurvey's.
  void Pack() { settled_.Pack(); }
  void Unpack() { settled_.Unpack(); }
  // As TileStretch's.
  void Save(ByteWriter& out) const;
  static SettledStretches Load(ByteReader& in);

 private:
  void CollectSpare(std::size_t cell, std::span<const TileStretch> stretches);
  void SetAside(BoundedChoice& choice, Forgetting& forgetting, std::span<TileStretch> stretches);
  void Restore(std::span<const TileStretch> stretches, std::size_t cells);

  SettledSegments settled_;
  SettledSegments spare_;                    // packed; the places are those when it was made
  std::vector<std::uint32_t> spare_places_;  // of these the present ones
  CellMarks marks_;                          // packed

  std::vector<SegmentView> segments_;      // of a cell
  std::vector<SegmentView> rest_;          // of a cell, that do not count
  std::vector<ForgottenMark> cell_marks_;  // of a cell
};

}  // namespace atlas
