// What is known of the forgotten segments of a tile, sorted by cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/base/bytes.h"
#include "core/fusion/segment/forgotten_mark.h"
#include "core/fusion/survey/packed_arrays.h"

namespace atlas {

// Packed from Pack() to Unpack().
class CellMarks {
 public:
  CellMarks() = default;
  // Of what packed() was.
  explicit CellMarks(Bytes packed) : packed_(std::move(packed)) {}

  // To be filled cell by cell.
  void AppendCell(std::span<const ForgottenMark> marks) {
    marks_.insert(marks_.end(), marks.begin(), marks.end());
    cell_end_.push_back(static_cast<std::uint32_t>(marks_.size()));
  }
  // None while there are none at all.
  std::span<const ForgottenMark> Marks(std::size_t cell) const {
    if (cell_end_.empty()) {
      return {};
    }
    const std::size_t begin = cell == 0 ? 0 : cell_end_[cell - 1];
    return std::span(marks_).subspan(begin, cell_end_[cell] - begin);
  }

  bool is_empty() const { return marks_.empty() && packed_.empty(); }
  std::size_t bytes() const {
    return packed_.capacity() + cell_end_.capacity() * sizeof(std::uint32_t) +
           marks_.capacity() * sizeof(ForgottenMark);
  }

  // Where there is none, nothing is left.
  void Pack() {
    packed_ = marks_.empty() ? Bytes() : PackArrays(cell_end_, marks_);
    cell_end_ = std::vector<std::uint32_t>();
    marks_ = std::vector<ForgottenMark>();
  }
  void Unpack() {
    if (!packed_.empty()) {
      UnpackArrays(packed_, cell_end_, marks_);
      packed_ = Bytes();
    }
  }
  const Bytes& packed() const { return packed_; }

 private:
  std::vector<std::uint32_t> cell_end_;
  std::vector<ForgottenMark> marks_;
  Bytes packed_;
};

}  // namespace atlas
