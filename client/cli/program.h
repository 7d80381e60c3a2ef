// What a program made of commands does with what the system gives it.
#pragma once

#include <memory>
#include <vector>

#include "client/cli/command_line/command.h"
#include "client/cli/command_line/command_line.h"

namespace atlas {

// The exit code: of the command, or of a failure that nobody expected.
int RunProgram(int argc,
               char** argv,
               const ProgramName& program,
               const std::vector<std::unique_ptr<Command>>& commands);

}  // namespace atlas
