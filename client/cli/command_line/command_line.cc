#include "client/cli/command_line/command_line.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <sstream>

#include <CLI/CLI.hpp>

#include "client/cli/output/json_text.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr const char* kFooter =
    "Exit codes: 0 ok, 1 failure, 2 usage, 3 not found, 4 conflict, 5 unavailable or timeout, 6 "
    "invalid data.";

struct CommonFlags {
  bool is_json = false;
  std::string server;
  ConnectionTls tls;
  bool allow_plaintext = false;
  std::string token_file;
  std::optional<std::string> atlas_file;
};

// What says where a daemon is and who asks it.
constexpr std::array kDaemonFlags = {"--server",    "--tls-ca",   "--tls-certificate",
                                     "--tls-key",   "--tls-name", "--allow-plaintext",
                                     "--token-file"};

// CLI11 takes "-3" for a number but "-.5" for an option "-.".
std::string WithLeadingZero(const std::string& argument) {
  const bool is_bare_fraction = argument.size() > 2 && argument[0] == '-' && argument[1] == '.' &&
                                std::isdigit(static_cast<unsigned char>(argument[2])) != 0;
  return is_bare_fraction ? "-0" + argument.substr(1) : argument;
}

// The parser consumes from the back.
std::vector<std::string> Prepared(const std::vector<std::string>& arguments) {
  std::vector<std::string> prepared;
  std::transform(arguments.rbegin(), arguments.rend(), std::back_inserter(prepared),
                 WithLeadingZero);
  return prepared;
}

void AddCommonFlags(CLI::App& app, CommonFlags& common) {
  app.add_flag("--json", common.is_json, "Print JSON")->disable_flag_override();
  app.add_option("--server", common.server, "The daemon [ATLAS_SERVER, else 127.0.0.1:7447]")
      ->type_name("HOST:PORT");
  const auto add_file = [&app](const char* name, const char* variable, auto& target,
                               const std::string& help) {
    app.add_option(name, target, StrCat(help, " [", variable, "]"))
        ->envname(variable)
        ->type_name("FILE")
        ->group("Security");
  };
  add_file("--tls-ca", "ATLAS_TLS_CA", common.tls.ca, "Speak TLS; who vouches for the daemon, PEM");
  add_file("--tls-certificate", "ATLAS_TLS_CERTIFICATE", common.tls.certificate, "Ours, PEM");
  add_file("--tls-key", "ATLAS_TLS_KEY", common.tls.key, "Of our certificate, PEM");
  app.add_option("--tls-name", common.tls.daemon_name,
                 "The daemon's name in its certificate [ATLAS_TLS_NAME, else the host]")
      ->envname("ATLAS_TLS_NAME")
      ->type_name("NAME")
      ->group("Security");
  app.add_flag("--allow-plaintext", common.allow_plaintext,
               "Speak without TLS beyond loopback, too [ATLAS_ALLOW_PLAINTEXT]")
      ->disable_flag_override()
      ->envname("ATLAS_ALLOW_PLAINTEXT")
      ->group("Security");
  add_file("--token-file", "ATLAS_TOKEN_FILE", common.token_file, "Holds our token");
}

void AddAtlasFlag(CLI::App& app, CommonFlags& common) {
  const auto set = [&common](const std::string& text) {
    if (text.empty() || text.starts_with("--")) {
      throw CLI::ValidationError("--atlas", "expected the file of an atlas");
    }
    common.atlas_file = text;
  };
  app.add_option_function<std::string>(
         "--atlas", set,
         "Read this file, a daemon's atlas.db or a copy of it, instead of asking a daemon")
      ->type_name("FILE");
}

void AddArgument(CLI::App& app, const Argument& argument) {
  const auto set = [argument](const std::string& text) {
    if (text.starts_with("--")) {  // "-o --json": the parser would write a file of that name
      throw CLI::ValidationError(argument.name, "has no value before " + text.substr(0, 80));
    }
    if (const Status status = argument.set(text); !status.ok()) {
      throw CLI::ValidationError(argument.name, status.message());
    }
  };
  if (argument.value_name.empty()) {
    app.add_flag_function(
           argument.name, [set](std::int64_t) { set(""); }, argument.help)
        ->disable_flag_override();
    return;
  }
  if (argument.is_repeated) {
    const auto set_each = [set](const std::vector<std::string>& texts) {
      std::for_each(texts.begin(), texts.end(), set);
    };
    app.add_option_function<std::vector<std::string>>(argument.name, set_each, argument.help)
        ->type_name(argument.value_name)
        ->allow_extra_args(false);  // one behind each
    return;
  }
  CLI::Option* option = app.add_option_function<std::string>(argument.name, set, argument.help);
  option->required(argument.is_required)->type_name(argument.value_name);
}

// "poses apply" is `apply` below `poses`, which is made when it is first needed.
CLI::App& SubcommandFor(CLI::App& root, const Command& command) {
  std::istringstream words(command.Name());
  CLI::App* app = &root;
  std::string word;
  while (words >> word) {
    const auto found = app->get_subcommands(
        [&word](const CLI::App* candidate) { return candidate->get_name() == word; });
    app = found.empty() ? app->add_subcommand(word) : found.front();
  }
  for (CLI::App* group = app->get_parent(); group != nullptr && group != &root;
       group = group->get_parent()) {
    group->require_subcommand(1);
    const std::string before = group->get_description();
    group->description(before.empty() ? command.Summary() : before + "; " + command.Summary());
  }
  app->description(command.Summary());
  return *app;
}

Result<Endpoint> ServerEndpoint(const CommonFlags& common, const CommandLineIo& io) {
  if (!common.server.empty()) return Endpoint::Parse(common.server);
  if (io.server_from_environment && !io.server_from_environment->empty()) {
    return Endpoint::Parse(*io.server_from_environment);
  }
  return Endpoint{};
}

// The parser asks for a missing command before it minds an unknown one.
Status CheckCommandName(const std::vector<std::string>& arguments, const CLI::App& root) {
  const auto word =
      std::find_if(arguments.begin(), arguments.end(),
                   [](const std::string& argument) { return !argument.starts_with('-'); });
  if (word == arguments.end() || (word != arguments.begin() && *(word - 1) == "--server")) {
    return {};
  }
  const auto found = root.get_subcommands(
      [&word](const CLI::App* candidate) { return candidate->get_name() == *word; });
  return found.empty() ? Status(StatusCode::kInvalidArgument,
                                StrCat("unknown command '", word->substr(0, 80), "'"))
                       : Status();
}

// The first line of the file.
Result<std::string> ReadToken(const std::string& file) {
  std::ifstream in(file);
  std::string token;
  if (!std::getline(in, token) || token.empty()) {
    return Error(StatusCode::kNotFound, StrCat("there is no token in ", file));
  }
  return token;
}

Result<ConnectionOptions> ConnectionFrom(const CommonFlags& common, const CommandLineIo& io) {
  const Result<Endpoint> server = ServerEndpoint(common, io);
  if (!server) return Error(server.error());
  ConnectionOptions options;
  options.endpoint = *server;
  options.client_name = io.program.name;
  if (!common.tls.ca.empty()) {
    options.tls = common.tls;
  } else if (!common.tls.certificate.empty() || !common.tls.key.empty() ||
             !common.tls.daemon_name.empty()) {
    return Error(StatusCode::kInvalidArgument,
                 "--tls-certificate, --tls-key and --tls-name are of TLS: expected --tls-ca, too");
  }
  options.allow_plaintext = common.allow_plaintext;
  if (common.tls.certificate.empty() != common.tls.key.empty()) {
    return Error(StatusCode::kInvalidArgument,
                 "--tls-certificate and --tls-key: one without the other is of no use");
  }
  if (!common.token_file.empty()) {
    Result<std::string> token = ReadToken(common.token_file);
    if (!token) return Error(token.error());
    options.token = *std::move(token);
  }
  return options;
}

Status RunCommand(Command& command, const CommonFlags& common, const CommandLineIo& io) {
  // Of a daemon nothing is asked beside a file: how it is reached does not matter.
  Result<ConnectionOptions> connection =
      common.atlas_file ? ConnectionOptions() : ConnectionFrom(common, io);
  if (!connection) return connection.error();
  CommandContext context{io.out,
                         io.err,
                         common.is_json,
                         io.is_err_terminal,
                         io.is_out_terminal,
                         *std::move(connection),
                         common.atlas_file};
  return command.Run(context);
}

// What the environment says of a daemon does not count: it is there for other commands.
Status CheckAtlasAlone(const std::vector<std::string>& arguments, const CommonFlags& common) {
  if (!common.atlas_file) return {};
  for (const std::string flag : kDaemonFlags) {
    const bool is_given =
        std::any_of(arguments.begin(), arguments.end(), [&flag](const std::string& argument) {
          return argument == flag || argument.starts_with(flag + "=");
        });
    if (is_given) {
      return {StatusCode::kInvalidArgument,
              StrCat("--atlas reads a file, ", flag, " asks a daemon: expected one of them")};
    }
  }
  return {};
}

class Parser {
 public:
  Parser(std::span<const std::unique_ptr<Command>> commands,
         const ProgramName& program,
         CommonFlags& common)
      : root_(program.description, program.name) {
    root_.set_version_flag("--version", program.name + " " ATLAS_VERSION);
    root_.footer(kFooter);
    root_.require_subcommand(1);
    AddCommonFlags(root_, common);
    for (const auto& command : commands) {
      CLI::App& app = SubcommandFor(root_, *command);
      AddCommonFlags(app, common);
      if (command->ReadsAtlasFiles()) AddAtlasFlag(app, common);
      ArgumentSet arguments;
      command->Declare(arguments);
      for (const Argument& argument : arguments.arguments()) {
        AddArgument(app, argument);
      }
      apps_.emplace_back(&app, command.get());
    }
  }

  // The command asked for; nullptr when help or the version was printed.
  Result<Command*> Parse(const std::vector<std::string>& arguments, std::ostream& out) {
    if (Status status = CheckCommandName(arguments, root_); !status.ok()) {
      return Error(std::move(status));
    }
    try {
      root_.parse(Prepared(arguments));
    } catch (const CLI::ParseError& error) {
      if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
        std::ostringstream unused;
        root_.exit(error, out, unused);
        return nullptr;
      }
      return Error(StatusCode::kInvalidArgument, error.what());
    }
    const auto parsed = std::find_if(apps_.begin(), apps_.end(),
                                     [](const auto& entry) { return entry.first->parsed(); });
    return parsed->second;
  }

 private:
  CLI::App root_;
  std::vector<std::pair<CLI::App*, Command*>> apps_;
};

}  // namespace

bool IsJsonAskedFor(const std::vector<std::string>& arguments) {
  return std::find(arguments.begin(), arguments.end(), "--json") != arguments.end();
}

void PrintFailure(const Status& status,
                  const std::string& program,
                  bool is_json,
                  std::ostream& err) {
  if (is_json) {
    boost::json::object error = {
        {"code", StatusCodeName(status.code())},
        {"message", status.message()},
    };
    if (status.reason() != StatusReason::kNone) {
      error["reason"] = StatusReasonName(status.reason());
    }
    err << JsonText(boost::json::object{{"error", error}}) << '\n';
  } else {
    err << program << ": " << status.message() << '\n';
  }
}

ExitCode RunCommandLine(const std::vector<std::string>& arguments,
                        std::span<const std::unique_ptr<Command>> commands,
                        const CommandLineIo& io) {
  CommonFlags common;
  Parser parser(commands, io.program, common);
  Result<Command*> command = parser.Parse(arguments, io.out);
  if (const Status alone = CheckAtlasAlone(arguments, common); !alone.ok()) command = Error(alone);
  if (!command) {
    const bool is_json = IsJsonAskedFor(arguments);
    PrintFailure(command.error(), io.program.name, is_json, io.err);
    if (!is_json) io.err << "Run with --help for more information.\n";
    return ExitCode::kUsage;
  }
  if (*command == nullptr) return ExitCode::kSuccess;
  const Status status = RunCommand(**command, common, io);
  if (!status.ok()) PrintFailure(status, io.program.name, common.is_json, io.err);
  return ExitCodeFor(status.code());
}

}  // namespace atlas
