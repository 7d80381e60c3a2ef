// The text format of Prometheus (0.0.4) read strictly, line by line.
#pragma once

#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace atlas {

// Samples by name with their labels as they stand: `roadatlas_tiles`, `x_total{kind="sync"}`. Any
// line that breaks the format fails the test.
inline std::map<std::string, double> ParseMetrics(const std::string& text) {
  static const std::regex kHelp(R"(# HELP ([a-zA-Z_:][a-zA-Z0-9_:]*) \S.*)");
  static const std::regex kType(R"(# TYPE ([a-zA-Z_:][a-zA-Z0-9_:]*) (counter|gauge|histogram))");
  static const std::regex kSample(
      R"RE(([a-zA-Z_:][a-zA-Z0-9_:]*)(\{[a-z_]+="[^"\\\n]*"(,[a-z_]+="[^"\\\n]*")*\})? (\S+))RE");
  std::map<std::string, double> samples;
  std::set<std::string> types;
  std::string family;
  EXPECT_TRUE(text.empty() || text.back() == '\n');
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, kType)) {
      EXPECT_TRUE(types.insert(match[1]).second) << "twice: " << line;
      family = match[1];
    } else if (std::regex_match(line, match, kSample)) {
      EXPECT_EQ(match[1].str().rfind(family, 0), 0u) << line << " within " << family;
      std::size_t used = 0;
      const double value = std::stod(match[4].str(), &used);
      EXPECT_EQ(used, match[4].str().size()) << line;
      EXPECT_TRUE(samples.emplace(match[1].str() + match[2].str(), value).second) << line;
    } else {
      EXPECT_TRUE(std::regex_match(line, kHelp)) << "no line of the format: " << line;
    }
  }
  return samples;
}

}  // namespace atlas
