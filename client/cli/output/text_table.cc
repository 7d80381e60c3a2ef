#include "client/cli/output/text_table.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <ctime>
#include <iomanip>
#include <sstream>

namespace atlas {
namespace {

std::vector<std::size_t> ColumnWidths(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], row[i].size());
    }
  }
  return widths;
}

std::string Padded(const std::string& text, std::size_t width, bool is_right) {
  const std::string padding(width - text.size(), ' ');
  return is_right ? padding + text : text + padding;
}

}  // namespace

TextTable::TextTable(std::vector<std::string> header) {
  for (std::string& name : header) {
    is_right_.push_back(!name.empty() && name.front() == '>');
    if (is_right_.back()) name.erase(0, 1);
  }
  rows_.push_back(std::move(header));
}

void TextTable::Row(std::vector<std::string> cells) {
  assert(cells.size() == is_right_.size());
  rows_.push_back(std::move(cells));
}

void TextTable::Print(std::ostream& out) const {
  const std::vector<std::size_t> widths = ColumnWidths(rows_);
  for (const auto& row : rows_) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      line += (i == 0 ? "" : "  ") + Padded(row[i], widths[i], is_right_[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out << line << '\n';
  }
}

void FactList::Add(std::string name, std::string value) {
  facts_.emplace_back(std::move(name), std::move(value));
}

void FactList::Print(std::ostream& out) const {
  std::size_t width = 0;
  for (const auto& [name, value] : facts_) {
    width = std::max(width, name.size());
  }
  for (const auto& [name, value] : facts_) {
    out << Padded(name, width, false) << "  " << value << '\n';
  }
}

std::string FixedText(double value, int decimals) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(decimals) << value;
  return std::move(out).str();
}

std::string BytesText(std::uint64_t bytes) {
  constexpr std::array<const char*, 5> kUnits = {"B", "kB", "MB", "GB", "TB"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 999.5 && unit + 1 < kUnits.size()) {
    value /= 1000.0;
    ++unit;
  }
  return FixedText(value, unit == 0 || value >= 100.0 ? 0 : 1) + " " + kUnits[unit];
}

std::string UtcText(std::uint32_t seconds) {
  const std::time_t time = seconds;
  std::tm utc{};
  gmtime_r(&time, &utc);
  std::ostringstream text;
  text << std::put_time(&utc, "%Y-%m-%d %H:%M:%S");
  return text.str();
}

std::string HexText(ByteSpan bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 0xF];
  }
  return text;
}

}  // namespace atlas
