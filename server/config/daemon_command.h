// The command line of the daemon: flags > environment > file > default.
#pragma once

#include <optional>
#include <string>

#include "core/base/status.h"
#include "server/config/daemon_config.h"

namespace atlas {

// What the command line asks for: to run with a configuration, or to print a text and end.
struct DaemonCommand {
  DaemonConfig config;
  GivenSettings given;              // that it is made of
  std::optional<std::string> text;  // of --help or --version
};

// kInvalidArgument on unknown flags and keys, on values (named with their flag, variable, or file
// and line), and on an address that is not loopback; kNotFound on a configuration file that is not
// there.
Result<DaemonCommand> ParseDaemonCommand(int argc, const char* const* argv);

}  // namespace atlas
