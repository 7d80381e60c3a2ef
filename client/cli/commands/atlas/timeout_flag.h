// --timeout, as every command has it that waits for fusion.
#pragma once

#include <chrono>

#include "client/cli/command_line/argument_set.h"

namespace atlas {

// `timeout` holds the default, which the help shows.
void DeclareTimeout(ArgumentSet& arguments, std::chrono::milliseconds& timeout);

}  // namespace atlas
