// A row's number in the file of an atlas that nobody has open, with bits turned as a disk turns
// them: no index and no checksum goes along.
#pragma once

#include <cstdint>
#include <optional>

#include "tests/server/store/turned_bits.h"

namespace atlas::testing {

// Where rows of tables stand in a file.
class RowPlaces {
 public:
  explicit RowPlaces(std::string_view file) : file_(file) {}

  // The place of the last byte of a row's number, in the tree that begins on that page (from 1).
  std::optional<std::size_t> Find(std::size_t page, std::uint64_t number) const {
    const std::size_t begin = (page - 1) * kPageBytes;
    const bool is_leaf = Byte(begin) == kLeafOfTable;
    for (std::uint64_t i = 0; i < Integer(begin + 3, 2); ++i) {
      std::size_t at = begin + Integer(begin + (is_leaf ? 8 : 12) + 2 * i, 2);
      if (!is_leaf) {
        if (const auto found = Find(Integer(at, 4), number)) {
          return found;
        }
        continue;
      }
      ReadVarint(at);  // bytes of the row
      if (ReadVarint(at) == number) {
        return at - 1;
      }
    }
    return is_leaf ? std::nullopt : Find(Integer(begin + 8, 4), number);
  }

 private:
  static constexpr std::uint8_t kLeafOfTable = 13;

  std::uint8_t Byte(std::size_t at) const { return static_cast<std::uint8_t>(file_.at(at)); }
  std::uint64_t Integer(std::size_t at, std::size_t bytes) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      value = value << 8U | Byte(at + i);
    }
    return value;
  }
  // Of up to nine bytes; the ninth has no bit that says whether there is another one.
  std::uint64_t ReadVarint(std::size_t& at) const {
    std::uint64_t value = 0;
    for (int i = 0; i < 8; ++i) {
      const std::uint8_t byte = Byte(at++);
      value = value << 7U | (byte & 0x7FU);
      if (byte < 0x80U) {
        return value;
      }
    }
    return value << 8U | Byte(at++);
  }

  std::string_view file_;
};

// Turns `mask` in the last seven bits of the number of a row.
inline void TurnNumber(const std::filesystem::path& database,
                       const std::string& table,
                       std::uint64_t number,
                       std::uint8_t mask) {
  std::ifstream in(database, std::ios::binary);
  std::string file{std::istreambuf_iterator<char>(in), {}};
  const auto at = RowPlaces(file).Find(RootPage(database, table), number);
  ASSERT_TRUE(at) << table << " has no row " << number;
  file[*at] = static_cast<char>(static_cast<std::uint8_t>(file[*at]) ^ mask);
  std::ofstream(database, std::ios::binary) << file;
}

}  // namespace atlas::testing
