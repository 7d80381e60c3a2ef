// The program `atlas`.
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>

#include <unistd.h>

#include "client/cli/command_line.h"

namespace {

std::optional<std::string> FromEnvironment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): before any thread
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

int Run(int argc, char** argv) {
  const std::vector<std::unique_ptr<atlas::Command>> commands = atlas::MakeCommands();
  const atlas::CommandLineIo io{std::cout, std::cerr, isatty(STDERR_FILENO) == 1,
                                FromEnvironment("ATLAS_SERVER")};
  const std::vector<std::string> arguments(argv + std::min(1, argc), argv + argc);
  const atlas::ExitCode code = atlas::RunCommandLine(arguments, commands, io);
  if (!std::cout.flush()) {
    std::cerr << "atlas: cannot write to standard output\n";
    return static_cast<int>(atlas::ExitCode::kFailure);
  }
  return static_cast<int>(code);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "atlas: unexpected failure: " << error.what() << '\n';
    return static_cast<int>(atlas::ExitCode::kFailure);
  }
}
