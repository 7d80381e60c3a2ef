// Joins strings and numbers into one string, for messages: StrCat("tile ", id, ": ", bytes, " B").
#pragma once

#include <sstream>
#include <string>

namespace atlas {

template <typename... Parts>
std::string StrCat(const Parts&... parts) {
  std::ostringstream out;
  out.precision(9);
  (out << ... << parts);
  return std::move(out).str();
}

}  // namespace atlas
