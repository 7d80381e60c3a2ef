#include "client/cli/program.h"

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <optional>
#include <string>

#include <malloc.h>
#include <unistd.h>

namespace atlas {
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

}  // namespace

int RunProgram(int argc,
               char** argv,
               const ProgramName& program,
               const std::vector<std::unique_ptr<Command>>& commands) {
  KeepFreedMemory();
  const std::vector<std::string> arguments(argv + std::min(1, argc), argv + argc);
  const auto fail = [&](const std::string& message) {
    PrintFailure({StatusCode::kInternal, message}, program.name, IsJsonAskedFor(arguments),
                 std::cerr);
    return static_cast<int>(ExitCode::kFailure);
  };
  try {
    const CommandLineIo io{std::cout,
                           std::cerr,
                           isatty(STDERR_FILENO) == 1,
                           FromEnvironment("ATLAS_SERVER"),
                           isatty(STDOUT_FILENO) == 1,
                           program};
    const ExitCode code = RunCommandLine(arguments, commands, io);
    if (!std::cout.flush()) return fail("cannot write to standard output");
    return static_cast<int>(code);
  } catch (const std::exception& error) {
    return fail(std::string("unexpected failure: ") + error.what());
  }
}

}  // namespace atlas
