// The program `atlas-merge`.
#include "client/cli/commands/merge/merge_commands.h"
#include "client/cli/program.h"

int main(int argc, char** argv) {
  return atlas::RunProgram(argc, argv,
                           {"atlas-merge",
                            "Makes one map of sessions that drifted apart: data on stdout, "
                            "everything else on stderr."},
                           atlas::MakeMergeCommands());
}
