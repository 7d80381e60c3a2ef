#include "core/fusion/survey/settled_segments.h"

#include "core/fusion/survey/packed_arrays.h"

namespace atlas {

std::size_t SettledSegments::bytes() const {
  return cell_end_.capacity() * sizeof(std::uint32_t) + segments_.capacity() * sizeof(Segment) +
         stretches_.capacity() * sizeof(std::uint32_t) + packed_.capacity();
}

void SettledSegments::Renumber(std::span<const std::uint32_t> numbers, CellSet& touched) {
  bool is_same = true;
  for (std::uint32_t i = 0; i < numbers.size(); ++i) {
    is_same &= numbers[i] == i;
  }
  if (is_same || is_empty()) {
    return;
  }
  packed_ = Bytes();
  std::size_t kept = 0;
  std::size_t i = 0;
  for (std::size_t cell = 0; cell < cell_end_.size(); ++cell) {
    for (; i < cell_end_[cell]; ++i) {
      const std::uint32_t number = numbers[stretches_[i]];
      if (number == kGone) {
        touched.Insert(cell);
        continue;
      }
      stretches_[kept] = number;
      if (kept != i) {
        segments_[kept] = segments_[i];
      }
      ++kept;
    }
    cell_end_[cell] = static_cast<std::uint32_t>(kept);
  }
  segments_.resize(kept);
  stretches_.resize(kept);
}

void SettledSegments::CopyTo(std::uint32_t stretch, StretchSurvey& survey) const {
  std::size_t begin = 0;
  for (std::size_t cell = 0; cell < cell_end_.size(); ++cell) {
    for (std::size_t i = cell_end_[cell]; i-- > begin;) {  // each comes before the last
      if (stretches_[i] == stretch) {
        survey.AddSegment(cell, segments_[i]);
      }
    }
    begin = cell_end_[cell];
  }
}

Bytes SettledSegments::PackedCopy() const {
  return packed_.empty() ? PackArrays(cell_end_, segments_, stretches_) : packed_;
}

void SettledSegments::Pack() {
  if (packed_.empty()) {
    packed_ = PackedCopy();
  }
  cell_end_ = std::vector<std::uint32_t>();
  segments_ = std::vector<Segment>();
  stretches_ = std::vector<std::uint32_t>();
}

void SettledSegments::Unpack() {
  UnpackArrays(packed_, cell_end_, segments_, stretches_);
  for (Segment& segment : segments_) {
    segment.is_used = false;
  }
}

}  // namespace atlas
