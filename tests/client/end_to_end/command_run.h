// A command of `atlas` run within the test, its JSON read back.
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include <boost/json/parse.hpp>

#include "client/cli/command_line/command_line.h"
#include "client/cli/commands/commands.h"

namespace atlas {

struct CommandRun {
  int exit_code = -1;
  std::string out;
  std::vector<boost::json::value> lines;  // of it
  std::string err;

  const boost::json::value& json() const { return lines.at(lines.size() - 1); }
  template <typename T>
  T Get(const std::string& key) const {
    return json().at(key).to_number<T>();
  }
};

inline CommandRun RunAtlas(const std::string& server, std::vector<std::string> arguments) {
  arguments.emplace_back("--json");
  std::ostringstream out;
  std::ostringstream err;
  const auto commands = MakeCommands();
  CommandRun run;
  run.exit_code = static_cast<int>(RunCommandLine(arguments, commands, {out, err, false, server}));
  run.out = out.str();
  std::istringstream lines(run.out);
  for (std::string line; std::getline(lines, line);) {
    run.lines.push_back(boost::json::parse(line));
  }
  run.err = err.str();
  return run;
}

}  // namespace atlas
