#include "client/cli/output/json_text.h"

#include <array>
#include <charconv>
#include <cmath>

#include <boost/json/serialize.hpp>

namespace atlas {
namespace {

// Between these a number stands without an exponent.
constexpr double kSmallestPlain = 1e-6;
constexpr double kLargestPlain = 1e15;

void AppendNumber(double value, std::string& out) {
  if (!std::isfinite(value)) {
    out += "null";
    return;
  }
  const double magnitude = std::abs(value);
  const bool is_plain = value == 0.0 || (magnitude >= kSmallestPlain && magnitude < kLargestPlain);
  std::array<char, 64> text{};
  const auto format = is_plain ? std::chars_format::fixed : std::chars_format::scientific;
  const auto result =
      std::to_chars(text.data(), text.data() + text.size(), value + 0.0, format);  // no "-0"
  out.append(text.data(), result.ptr);
}

void Append(const boost::json::value& value, std::string& out);

void AppendArray(const boost::json::array& array, std::string& out) {
  out += '[';
  bool is_first = true;
  for (const boost::json::value& element : array) {
    if (!is_first) out += ',';
    is_first = false;
    Append(element, out);
  }
  out += ']';
}

void AppendObject(const boost::json::object& object, std::string& out) {
  out += '{';
  bool is_first = true;
  for (const auto& [key, element] : object) {
    if (!is_first) out += ',';
    is_first = false;
    out += boost::json::serialize(boost::json::string_view(key));
    out += ':';
    Append(element, out);
  }
  out += '}';
}

void Append(const boost::json::value& value, std::string& out) {
  if (const auto* object = value.if_object()) {
    AppendObject(*object, out);
  } else if (const auto* array = value.if_array()) {
    AppendArray(*array, out);
  } else if (const auto* number = value.if_double()) {
    AppendNumber(*number, out);
  } else {
    out += boost::json::serialize(value);
  }
}

}  // namespace

std::string JsonText(const boost::json::value& value) {
  std::string out;
  Append(value, out);
  return out;
}

double Rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  return std::round(value * scale) / scale;
}

}  // namespace atlas
