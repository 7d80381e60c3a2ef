// --author, as every command has it whose doing is written into the log of the atlas.
#pragma once

#include <optional>
#include <string>

#include "client/cli/command_line/argument_set.h"
#include "core/base/status.h"

namespace atlas {

class AuthorFlag {
 public:
  void Declare(ArgumentSet& arguments);
  // What was given; else whoever is logged in; else the command. kInvalidArgument: given, and no
  // name.
  Result<std::string> Author(const std::string& command) const;

 private:
  std::optional<std::string> given_;
};

}  // namespace atlas
