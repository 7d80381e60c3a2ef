// Every command of this build.
#pragma once

#include <memory>
#include <vector>

#include "client/cli/command_line/command.h"

namespace atlas {

// In the order of the help.
std::vector<std::unique_ptr<Command>> MakeCommands();

}  // namespace atlas
