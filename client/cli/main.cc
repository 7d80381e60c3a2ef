// The program `atlas`.
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>

#include <malloc.h>
#include <unistd.h>

#include "client/cli/command_line/command_line.h"
#include "client/cli/commands/commands.h"

namespace {

std::optional<std::string> FromEnvironment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): before any thread
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

// The buffers of a scan are megabytes, made and dropped for each: kept by the process instead of
// being mapped again, the front end takes 12.6 ms a scan instead of 15.6 (deploy/bench.sh
// frontend).
void KeepFreedMemory() {
  mallopt(M_MMAP_THRESHOLD, 64 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
}

int Fail(const std::string& message, const std::vector<std::string>& arguments) {
  atlas::PrintFailure({atlas::StatusCode::kInternal, message}, atlas::IsJsonAskedFor(arguments),
                      std::cerr);
  return static_cast<int>(atlas::ExitCode::kFailure);
}

int Run(const std::vector<std::string>& arguments) {
  const std::vector<std::unique_ptr<atlas::Command>> commands = atlas::MakeCommands();
  const atlas::CommandLineIo io{std::cout, std::cerr, isatty(STDERR_FILENO) == 1,
                                FromEnvironment("ATLAS_SERVER"), isatty(STDOUT_FILENO) == 1};
  const atlas::ExitCode code = atlas::RunCommandLine(arguments, commands, io);
  if (!std::cout.flush()) return Fail("cannot write to standard output", arguments);
  return static_cast<int>(code);
}

}  // namespace

int main(int argc, char** argv) {
  KeepFreedMemory();
  const std::vector<std::string> arguments(argv + std::min(1, argc), argv + argc);
  try {
    return Run(arguments);
  } catch (const std::exception& error) {
    return Fail(std::string("unexpected failure: ") + error.what(), arguments);
  }
}
