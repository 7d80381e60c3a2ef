// The parts of a text between separators, as files of tables have them.
#pragma once

#include <sstream>
#include <string>
#include <vector>

namespace atlas::testing {

inline std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

}  // namespace atlas::testing
