#include "client/cli/commands/merge/merge_commands.h"

namespace atlas {

std::vector<std::unique_ptr<Command>> MakeMergeCommands() {
  std::vector<std::unique_ptr<Command>> commands;
  commands.push_back(MakeMergeRunCommand());
  commands.push_back(MakeMergeServeCommand());
  return commands;
}

}  // namespace atlas
