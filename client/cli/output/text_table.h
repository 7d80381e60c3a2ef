// Aligned text for people: rows of cells in columns, numbers to the right.
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "core/base/bytes.h"

namespace atlas {

class TextTable {
 public:
  // Columns whose header starts with '>' are right-aligned.
  explicit TextTable(std::vector<std::string> header);

  // Requires as many cells as the header has.
  void Row(std::vector<std::string> cells);
  void Print(std::ostream& out) const;

 private:
  std::vector<bool> is_right_;
  std::vector<std::vector<std::string>> rows_;
};

// "name   value" lines.
class FactList {
 public:
  void Add(std::string name, std::string value);
  void Print(std::ostream& out) const;

 private:
  std::vector<std::pair<std::string, std::string>> facts_;
};

std::string FixedText(double value, int decimals);
// "12.4 MB": powers of 1000.
std::string BytesText(std::uint64_t bytes);
std::string HexText(ByteSpan bytes);
// "2026-03-01 12:30:05", UTC, of seconds since 1970.
std::string UtcText(std::uint32_t seconds);

}  // namespace atlas
