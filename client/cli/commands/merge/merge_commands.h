// The commands of `atlas-merge`.
#pragma once

#include <memory>
#include <vector>

#include "client/cli/command_line/command.h"

namespace atlas {

std::unique_ptr<Command> MakeMergeRunCommand();
std::unique_ptr<Command> MakeMergeServeCommand();

// All of them.
std::vector<std::unique_ptr<Command>> MakeMergeCommands();

}  // namespace atlas
