#include "core/scan/text_lines.h"

#include <charconv>
#include <cstddef>
#include <cstdint>

#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxTextBytes = 1u << 28;

}  // namespace

Result<std::vector<std::string>> ReadLines(const std::filesystem::path& path) {
  Result<Bytes> bytes = ReadFileBytes(path, kMaxTextBytes);
  if (!bytes) {
    return Error(bytes.error());
  }
  std::vector<std::string> lines(1);
  for (const std::uint8_t byte : *bytes) {
    if (byte == '\n') {
      lines.emplace_back();
    } else if (byte != '\r') {
      lines.back().push_back(static_cast<char>(byte));
    }
  }
  while (!lines.empty() && lines.back().find_first_not_of(" \t") == std::string::npos) {
    lines.pop_back();
  }
  return lines;
}

std::optional<std::vector<double>> ParseNumbers(std::string_view line) {
  std::vector<double> numbers;
  const char* at = line.data();
  const char* const end = at + line.size();
  while (true) {
    while (at != end && (*at == ' ' || *at == '\t')) {
      ++at;
    }
    if (at == end) {
      return numbers;
    }
    double value = 0.0;
    const auto [next, error] = std::from_chars(at, end, value);
    const bool is_whole_word = next == end || *next == ' ' || *next == '\t';
    if (error != std::errc() || !is_whole_word || numbers.size() > 64) {
      return std::nullopt;
    }
    numbers.push_back(value);
    at = next;
  }
}

}  // namespace atlas
