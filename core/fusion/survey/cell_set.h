// A set of the cells of a tile or band, a bit each.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace atlas {

class CellSet {
 public:
  CellSet() = default;
  explicit CellSet(std::size_t cells) : words_((cells + 63) / 64) {}

  void Insert(std::size_t cell) { words_[cell / 64] |= std::uint64_t{1} << (cell % 64); }
  bool Contains(std::size_t cell) const { return ((words_[cell / 64] >> (cell % 64)) & 1u) != 0; }
  // Of a set of as many cells.
  void InsertAll(const CellSet& other) {
    for (std::size_t i = 0; i < words_.size(); ++i) {
      words_[i] |= other.words_[i];
    }
  }
  void Fill() { std::fill(words_.begin(), words_.end(), ~std::uint64_t{0}); }
  void Clear() { std::fill(words_.begin(), words_.end(), 0); }

 private:
  std::vector<std::uint64_t> words_;
};

}  // namespace atlas
