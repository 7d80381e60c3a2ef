#include "client/cli/commands/commands.h"

#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/drive/drive_commands.h"
#include "client/cli/commands/map/map_commands.h"

namespace atlas {

std::vector<std::unique_ptr<Command>> MakeCommands() {
  std::vector<std::unique_ptr<Command>> commands;
  commands.push_back(MakeIngestCommand());
  commands.push_back(MakeWaitCommand());
  commands.push_back(MakeStatusCommand());
  commands.push_back(MakePointCommand());
  commands.push_back(MakeQueryCommand());
  commands.push_back(MakeWatchCommand());
  commands.push_back(MakePosesApplyCommand());
  commands.push_back(MakePosesUndoCommand());
  commands.push_back(MakeSessionsCommand());
  commands.push_back(MakeSessionRetractCommand());
  commands.push_back(MakeSessionRestoreCommand());
  commands.push_back(MakeSessionReleaseCommand());
  commands.push_back(MakeSessionPublishCommand());
  commands.push_back(MakeSessionPurgeCommand());
  commands.push_back(MakeVehicleRetractCommand());
  commands.push_back(MakeVehicleRestoreCommand());
  commands.push_back(MakeCompactCommand());
  commands.push_back(MakeDigestCommand());
  commands.push_back(MakeVerifyCommand());
  commands.push_back(MakeLogCommand());
  commands.push_back(MakeBackupCommand());
  commands.push_back(MakeBackupsCommand());
  commands.push_back(MakeRestoreCommand());
  commands.push_back(MakeSegmentCommand());
  commands.push_back(MakeLocalizeCommand());
  commands.push_back(MakePlanCommand());
  commands.push_back(MakeRenderCommand());
  commands.push_back(MakeExportCommand());
  commands.push_back(MakeSimulateCommand());
  return commands;
}

}  // namespace atlas
