// The program `atlas`.
#include "client/cli/commands/commands.h"
#include "client/cli/program.h"

int main(int argc, char** argv) {
  return atlas::RunProgram(argc, argv, {}, atlas::MakeCommands());
}
