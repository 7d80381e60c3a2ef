// One command of `atlas`: what it is called, what it takes, what it does.
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>

#include <boost/json/object.hpp>

#include "client/cli/command_line/argument_set.h"
#include "client/connection/atlas_client.h"
#include "client/connection/endpoint.h"
#include "core/base/status.h"

namespace atlas {

// What every command is given. Data goes to `out`, everything else to `err`.
struct CommandContext {
  std::ostream& out;
  std::ostream& err;
  bool is_json = false;
  bool is_err_terminal = false;
  bool is_out_terminal = false;
  ConnectionOptions connection;
  std::optional<std::filesystem::path> atlas_file;  // to read instead of asking a daemon

  Result<AtlasClient> Connect() const;
  // One object on one line, at once, so that a reader may follow a stream.
  void PrintJson(const boost::json::object& object) const;
};

class Command {
 public:
  virtual ~Command() = default;

  virtual std::string Name() const = 0;     // "point", "poses apply"
  virtual std::string Summary() const = 0;  // one line of help
  virtual void Declare(ArgumentSet& arguments) = 0;
  // True: it takes --atlas FILE, too, and then heeds CommandContext::atlas_file.
  virtual bool ReadsAtlasFiles() const { return false; }
  // A failure's code decides the exit code; its message is printed by the caller.
  virtual Status Run(CommandContext& context) = 0;
};

}  // namespace atlas
