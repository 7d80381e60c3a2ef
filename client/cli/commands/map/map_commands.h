// Commands that read tiles: a place, an area, a route, a picture, points.
#pragma once

#include <memory>

#include "client/cli/command_line/command.h"

namespace atlas {

std::unique_ptr<Command> MakeExportCommand();
std::unique_ptr<Command> MakePlanCommand();
std::unique_ptr<Command> MakePointCommand();
std::unique_ptr<Command> MakeQueryCommand();
std::unique_ptr<Command> MakeRenderCommand();
std::unique_ptr<Command> MakeWatchCommand();

}  // namespace atlas
