// From argv to a command's run to an exit code. The only file that knows the parsing library.
#pragma once

#include <memory>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "client/cli/command_line/command.h"
#include "client/cli/command_line/exit_code.h"

namespace atlas {

// A program made of commands.
struct ProgramName {
  std::string name = "atlas";
  std::string description =
      "The command line of Road Atlas: data on stdout, everything else on stderr.";
};

struct CommandLineIo {
  std::ostream& out;
  std::ostream& err;
  bool is_err_terminal = false;
  std::optional<std::string> server_from_environment;  // ATLAS_SERVER
  bool is_out_terminal = false;
  ProgramName program = {};
};

// `arguments` ask for JSON, well-formed or not.
bool IsJsonAskedFor(const std::vector<std::string>& arguments);

// One line: "PROGRAM: MESSAGE", or {"error":{"code","message"}}.
void PrintFailure(const Status& status,
                  const std::string& program,
                  bool is_json,
                  std::ostream& err);

// `arguments` without the program's name. Prints failures to `err`, as JSON after --json.
ExitCode RunCommandLine(const std::vector<std::string>& arguments,
                        std::span<const std::unique_ptr<Command>> commands,
                        const CommandLineIo& io);

}  // namespace atlas
