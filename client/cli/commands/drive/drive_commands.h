// Commands on recorded drives: made, segmented, uploaded, localized.
#pragma once

#include <memory>

#include "client/cli/command_line/command.h"

namespace atlas {

std::unique_ptr<Command> MakeIngestCommand();
std::unique_ptr<Command> MakeLocalizeCommand();
std::unique_ptr<Command> MakeSegmentCommand();
std::unique_ptr<Command> MakeSimulateCommand();

}  // namespace atlas
