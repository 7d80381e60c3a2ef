// The commands, one factory each; MakeCommands lists them.
#pragma once

#include <memory>

#include "client/cli/command.h"

namespace atlas {

std::unique_ptr<Command> MakeDigestCommand();
std::unique_ptr<Command> MakeIngestCommand();
std::unique_ptr<Command> MakeLocalizeCommand();
std::unique_ptr<Command> MakePlanCommand();
std::unique_ptr<Command> MakePointCommand();
std::unique_ptr<Command> MakePosesApplyCommand();
std::unique_ptr<Command> MakeQueryCommand();
std::unique_ptr<Command> MakeRenderCommand();
std::unique_ptr<Command> MakeSegmentCommand();
std::unique_ptr<Command> MakeSessionsCommand();
std::unique_ptr<Command> MakeSimulateCommand();
std::unique_ptr<Command> MakeStatusCommand();
std::unique_ptr<Command> MakeVerifyCommand();
std::unique_ptr<Command> MakeWaitCommand();

}  // namespace atlas
