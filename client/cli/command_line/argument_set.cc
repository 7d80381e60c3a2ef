#include "client/cli/command_line/argument_set.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

Status Expected(std::string_view what, std::string_view text) {
  return {StatusCode::kInvalidArgument, StrCat("'", text.substr(0, 80), "': expected ", what)};
}

// The whole text as one number.
template <typename T>
bool ReadNumber(std::string_view text, T& value) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const char* end = text.data() + text.size();
  const auto [position, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && position == end;
}

bool ReadFinite(std::string_view text, double& value) {
  return ReadNumber(text, value) && std::isfinite(value);
}

// Exactly `values.size()` numbers between commas.
bool ReadList(std::string_view text, std::span<double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t comma = text.find(',');
    const bool is_last = i + 1 == values.size();
    if (is_last != (comma == std::string_view::npos)) return false;
    if (!ReadFinite(text.substr(0, comma), values[i])) return false;
    text.remove_prefix(is_last ? text.size() : comma + 1);
  }
  return true;
}

std::string Join(const std::vector<std::string>& words) {
  std::string joined;
  for (const std::string& word : words) {
    joined += joined.empty() ? word : "|" + word;
  }
  return joined;
}

}  // namespace

Status ParseValue(const std::string& text, std::string& value) {
  value = text;
  return {};
}

Status ParseValue(const std::string& text, double& value) {
  return ReadFinite(text, value) ? Status() : Expected("a number", text);
}

Status ParseValue(const std::string& text, std::int32_t& value) {
  return ReadNumber(text, value) ? Status() : Expected("a whole number", text);
}

Status ParseValue(const std::string& text, std::uint32_t& value) {
  return ReadNumber(text, value) ? Status() : Expected("a whole number from 0 to 4294967295", text);
}

Status ParseValue(const std::string& text, std::uint64_t& value) {
  return ReadNumber(text, value) ? Status() : Expected("a whole number, 0 or more", text);
}

Status ParseValue(const std::string& text, std::chrono::milliseconds& value) {
  double seconds = 0.0;
  if (!ReadFinite(text, seconds) || seconds < 0.0 || seconds > 1e6) {
    return Expected("seconds from 0 to 1000000", text);
  }
  value = std::chrono::milliseconds(std::llround(seconds * 1e3));
  return {};
}

Status ParseValue(const std::string& text, Eigen::Vector2d& value) {
  return ReadList(text, std::span(value.data(), 2))
             ? Status()
             : Expected("two numbers with a comma between them", text);
}

Status ParseValue(const std::string& text, Eigen::Vector3d& value) {
  return ReadList(text, std::span(value.data(), 3)) ? Status()
                                                    : Expected("three numbers X,Y,Z", text);
}

Status ParseValue(const std::string& text, NumberRange& value) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return Expected("a range A:B of scan numbers", text);
  const std::string_view begin = std::string_view(text).substr(0, colon);
  const std::string_view end = std::string_view(text).substr(colon + 1);
  NumberRange range;
  const bool is_read = (begin.empty() || ReadNumber(begin, range.begin)) &&
                       (end.empty() || ReadNumber(end, range.end));
  if (!is_read || range.begin > range.end) {
    return Expected("a range A:B of scan numbers with A <= B", text);
  }
  value = range;
  return {};
}

Status ParseValue(const std::string& text, Perturbation& value) {
  std::array<double, 2> numbers{};
  if (!ReadList(text, numbers) || numbers[0] < 0.0 || numbers[1] < 0.0) {
    return Expected("metres,degrees, both 0 or more", text);
  }
  value = {numbers[0], numbers[1]};
  return {};
}

Status ParseValue(const std::string& text, SeededNoise& value) {
  const std::string_view whole = text;
  const std::size_t first = whole.find(',');
  const std::size_t second = first == std::string::npos ? first : whole.find(',', first + 1);
  SeededNoise noise;
  bool is_read = ReadFinite(whole.substr(0, first), noise.sigma_m) && noise.sigma_m > 0.0;
  if (first != std::string::npos) {
    is_read = ReadNumber(whole.substr(first + 1, second - first - 1), noise.seed) && is_read;
  }
  if (second != std::string::npos) {
    is_read = ReadFinite(whole.substr(second + 1), noise.wandering) && is_read;
  }
  if (!is_read) return Expected("metres above 0, or metres,seed, or metres,seed,share", text);
  value = noise;
  return {};
}

Status ParseValue(const std::string& text, SessionKey& value) {
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) return Expected("VEHICLE/SESSION", text);
  SessionKey key{text.substr(0, slash), text.substr(slash + 1)};
  ATLAS_RETURN_IF_ERROR(key.Validate());
  value = std::move(key);
  return {};
}

void ArgumentSet::Flag(std::string name, bool& target, std::string help) {
  arguments_.push_back({std::move(name), "", std::move(help), false, [&target](const std::string&) {
                          target = true;
                          return Status();
                        }});
}

void ArgumentSet::Choice(std::string name,
                         std::vector<std::string> choices,
                         std::string& target,
                         const std::string& help) {
  std::string joined = Join(choices);
  arguments_.push_back({std::move(name), joined, StrCat(help, " [", target, "]"), false,
                        [choices = std::move(choices), joined, &target](const std::string& text) {
                          if (std::find(choices.begin(), choices.end(), text) == choices.end()) {
                            return Expected(joined, text);
                          }
                          target = text;
                          return Status();
                        }});
}

}  // namespace atlas
