// The segments of a tile's stretches that do not grow any more, sorted by cell: smaller than their
// surveys, and read from front to back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/base/bytes.h"
#include "core/fusion/segment/segment.h"
#include "core/fusion/survey/cell_set.h"
#include "core/fusion/survey/stretch_survey.h"

namespace atlas {

class SettledSegments {
 public:
  static constexpr std::uint32_t kGone = std::numeric_limits<std::uint32_t>::max();

  SettledSegments() = default;
  // Of a PackedCopy() of as many cells: Unpack() comes before anything else.
  explicit SettledSegments(Bytes packed) : packed_(std::move(packed)) {}

  // To be filled cell by cell: Append() its segments, then EndCell().
  void Reserve(std::size_t cells, std::size_t segments) {
    cell_end_.reserve(cells);
    segments_.reserve(segments);
    stretches_.reserve(segments);
  }
  void Append(const Segment& segment, std::uint32_t stretch) {
    segments_.push_back(segment);
    stretches_.push_back(stretch);
  }
  void EndCell() { cell_end_.push_back(static_cast<std::uint32_t>(segments_.size())); }

  bool is_empty() const { return segments_.empty(); }
  std::size_t size() const { return segments_.size(); }
  std::size_t bytes() const;

  // A cell's segments and the numbers of their stretches; none while there are none at all.
  std::span<Segment> Segments(std::size_t cell) {
    return std::span(segments_).subspan(Begin(cell), End(cell) - Begin(cell));
  }
  std::span<const std::uint32_t> Stretches(std::size_t cell) const {
    return std::span(stretches_).subspan(Begin(cell), End(cell) - Begin(cell));
  }

  // Stretch i becomes numbers[i], or is removed if that is kGone: its cells go into `touched`.
  void Renumber(std::span<const std::uint32_t> numbers, CellSet& touched);
  // Puts the segments of a stretch into `survey`, of the same cells and empty.
  void CopyTo(std::uint32_t stretch, StretchSurvey& survey) const;

  // As StretchSurvey's.
  void Pack();
  void Unpack();
  Bytes PackedCopy() const;

 private:
  std::size_t Begin(std::size_t cell) const {
    return cell == 0 || cell_end_.empty() ? 0 : cell_end_[cell - 1];
  }
  std::size_t End(std::size_t cell) const { return cell_end_.empty() ? 0 : cell_end_[cell]; }

  std::vector<std::uint32_t> cell_end_;  // offsets; empty: no cell has any
  std::vector<Segment> segments_;
  std::vector<std::uint32_t> stretches_;
  Bytes packed_;  // the above, if not empty
};

}  // namespace atlas
