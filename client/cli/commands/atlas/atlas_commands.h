// Commands about the atlas as a whole: what it holds, whether it is fused and sound, its poses and
// sessions.
#pragma once

#include <memory>

#include "client/cli/command_line/command.h"

namespace atlas {

std::unique_ptr<Command> MakeBackupCommand();
std::unique_ptr<Command> MakeBackupsCommand();
std::unique_ptr<Command> MakeCompactCommand();
std::unique_ptr<Command> MakeDigestCommand();
std::unique_ptr<Command> MakeLogCommand();
std::unique_ptr<Command> MakePosesApplyCommand();
std::unique_ptr<Command> MakePosesUndoCommand();
std::unique_ptr<Command> MakeRestoreCommand();
std::unique_ptr<Command> MakeSessionRestoreCommand();
std::unique_ptr<Command> MakeSessionReleaseCommand();
std::unique_ptr<Command> MakeSessionPublishCommand();
std::unique_ptr<Command> MakeSessionPurgeCommand();
std::unique_ptr<Command> MakeSessionRetractCommand();
std::unique_ptr<Command> MakeSessionsCommand();
std::unique_ptr<Command> MakeStatusCommand();
std::unique_ptr<Command> MakeVehicleRestoreCommand();
std::unique_ptr<Command> MakeVehicleRetractCommand();
std::unique_ptr<Command> MakeVerifyCommand();
std::unique_ptr<Command> MakeWaitCommand();

}  // namespace atlas
