// atlasd: opens the store, starts fusion, serves until it is told to stop.

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <google/protobuf/stubs/logging.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "core/base/str_cat.h"
#include "server/base/log_format.h"
#include "server/base/open_files.h"
#include "server/config/daemon_command.h"
#include "server/config/live_config.h"
#include "server/daemon_parts.h"
#include "server/hangup_watch.h"
#include "server/net/tcp_server.h"
#include "server/operations_port.h"
#include "server/service/atlas_service.h"

namespace atlas {
namespace {

// As for the command line: 1 failure, 2 usage, 3 not found, 4 conflict, 5 unavailable, 6 bad data.
int ExitCode(StatusCode code) {
  switch (code) {
    case StatusCode::kOk:
      return 0;
    case StatusCode::kInvalidArgument:
      return 2;
    case StatusCode::kNotFound:
      return 3;
    case StatusCode::kConflict:
      return 4;
    case StatusCode::kUnavailable:
    case StatusCode::kTimeout:
      return 5;
    case StatusCode::kInvalidData:
    case StatusCode::kUnsupported:
      return 6;
    default:
      return 1;
  }
}

int Fail(const Status& status) {
  spdlog::error("{}: {}", StatusCodeName(status.code()), status.message());
  return ExitCode(status.code());
}

std::int64_t NowMs() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

void Log(LogLevel level, const std::string& message) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::debug(message);
    case LogLevel::kInfo:
      return spdlog::info(message);
    case LogLevel::kWarning:
      return spdlog::warn(message);
    case LogLevel::kError:
      return spdlog::error(message);
  }
}

void SetLog(const DaemonConfig& config) {
  spdlog::set_level(spdlog::level::from_str(config.log_level));
  const auto format = LogFormatByName(config.log_format).value_or(LogFormat::kText);
  spdlog::set_formatter(MakeLogFormatter(format));
}

Result<LiveConfig::Commit> PrepareLog(const DaemonConfig& config) {
  return [config] {
    SetLog(config);
  };
}

std::string Joined(const std::vector<std::string>& keys) {
  std::string text;
  for (const std::string& key : keys) {
    text += (text.empty() ? "" : ", ") + key;
  }
  return text;
}

// The names of those that took effect.
std::string ChangesOf(const LiveConfig::Outcome& outcome) {
  std::vector<std::string> changes = outcome.changed;
  for (const std::string& key : outcome.renewed) {
    changes.push_back("file of " + key);
  }
  return changes.empty() ? "no setting and no file" : Joined(changes);
}

void ReloadConfig(LiveConfig& config) {
  Result<LiveConfig::Outcome> outcome = Error(StatusCode::kInternal, "");
  try {
    outcome = config.Reload();
  } catch (const std::exception& error) {  // without memory, say: no reason to end
    outcome = Error(StatusCode::kInternal, error.what());
  }
  if (!outcome) {
    spdlog::error("signal 1: the new configuration is refused, the old one stays: {}: {}",
                  StatusCodeName(outcome.error().code()), outcome.error().message());
    return;
  }
  spdlog::info("signal 1: configuration and its files read again, {} changed", ChangesOf(*outcome));
  if (!outcome->waiting.empty()) {
    spdlog::warn("signal 1: changes that need a restart: {}", Joined(outcome->waiting));
  }
}

// nullopt: it is off.
Result<std::optional<ListenSocket>> OpenHttpSocket(const DaemonConfig& config) {
  if (!config.http) {
    return std::nullopt;
  }
  Result<ListenSocket> socket = ListenSocket::Open(config.http->host, config.http->port);
  if (!socket) {
    return Error(socket.error());
  }
  return std::optional<ListenSocket>(*std::move(socket));
}

// TLS stays with or without, as it was at the start.
LiveConfig::Prepare PrepareSecurity(TcpServer& server, bool has_tls) {
  return [&server, has_tls](const DaemonConfig& config) -> Result<LiveConfig::Commit> {
    Result<ServerSecurity> security = SecurityFrom(config);
    if (!security) {
      return Error(security.error());
    }
    if ((security->tls != nullptr) != has_tls) {
      return Error(StatusCode::kInvalidArgument, "TLS, with it or without, takes a restart");
    }
    return [&server, next = *std::move(security)] {
      server.ChangeSecurity(next);
    };
  };
}

LiveConfig::Prepare PrepareNameLimits(TcpServer& server) {
  return [&server](const DaemonConfig& config) -> Result<LiveConfig::Commit> {
    return [&server, limits = NameLimitsFrom(config)] {
      server.ChangeNameLimits(limits);
    };
  };
}

LiveConfig::Prepare PrepareUploadRules(AtlasService& service) {
  return [&service](const DaemonConfig& config) -> Result<LiveConfig::Commit> {
    return [&service, options = ServiceFrom(config)] {
      service.set_sessions_per_hour(options.sessions_per_hour);
      service.SetRetention(options.retention);
      service.SetPlausibility(options.plausibility);
    };
  };
}

// A connection is a file, and the store has some.
void AllowConnections(const NetOptions& options) {
  constexpr std::size_t kOtherFiles = 256;
  const std::size_t wanted = options.max_connections + kOtherFiles;
  const std::size_t allowed = AllowOpenFiles(wanted);
  if (allowed < wanted) {
    spdlog::warn(
        "the system allows {} open files: {} are needed for {} connections; raise the "
        "limit (ulimit -n, LimitNOFILE)",
        allowed, wanted, options.max_connections);
  }
}

// `has_failed`: the disk did, even if it is found out last of all.
int Serve(LiveConfig& live, std::atomic<bool>& has_failed) {
  const DaemonConfig config = live.config();
  AllowConnections(NetFrom(config));
  Result<ServerSecurity> security = SecurityFrom(config);
  if (!security) {
    return Fail(security.error());
  }
  Result<ListenSocket> socket = ListenSocket::Open(config.host, config.port);
  if (!socket) {
    return Fail(socket.error());
  }
  Result<std::optional<ListenSocket>> http_socket = OpenHttpSocket(config);
  if (!http_socket) {
    return Fail(http_socket.error().WithContext("http"));
  }
  std::atomic<bool> is_serving = false;
  const auto stop = [&has_failed, &is_serving](const Status& why) {
    has_failed = true;
    spdlog::critical("{}; stopping", why.message());
    if (!is_serving) {
      std::_Exit(1);  // before, or behind: there is nobody to drain
    }
    ::kill(::getpid(), SIGTERM);
  };
  Result<std::unique_ptr<AtlasStore>> store = OpenStore(config, stop);
  if (!store) {
    return Fail(store.error());
  }
  AtlasService service(**store, &NowMs, &Log, ServiceFrom(config));
  const std::string address = socket->address();
  TcpServer server(service, NetFrom(config), *std::move(socket), *std::move(security));
  is_serving = true;  // from now on signals are the server's
  std::printf("listening %s\n", address.c_str());
  std::optional<OperationsPort> operations;
  if (*http_socket) {
    std::printf("http %s\n", (*http_socket)->address().c_str());
    operations.emplace(service, **store, server, **std::move(http_socket));
  }
  live.AddPart(PrepareSecurity(server, !config.tls_certificate.empty()));
  live.AddPart(PrepareNameLimits(server));
  live.AddPart(PrepareUploadRules(service));
  const HangupWatch hangups([&live] { ReloadConfig(live); });
  std::fflush(stdout);
  spdlog::info("atlas in {}", config.data.string());
  server.Run();
  is_serving = false;
  service.Stop();
  spdlog::info("stopped");
  return 0;
}

// What the library says of a message that it cannot read, the refusal of the message says too.
void LogProtobuf(google::protobuf::LogLevel /*level*/,
                 const char* /*file*/,
                 int /*line*/,
                 const std::string& message) {
  spdlog::debug("protobuf: {}", message);
}

int Main(int argc, const char* const* argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("atlasd"));
  google::protobuf::SetLogHandler(&LogProtobuf);
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the limit of a file fails as on a full disk
  std::signal(SIGHUP, SIG_IGN);   // until there is something that takes new settings
  const LiveConfig::Read read = [argc, argv] {
    return ParseDaemonCommand(argc, argv);
  };
  const Result<DaemonCommand> command = read();
  if (!command) {
    return Fail(command.error());
  }
  if (command->text) {
    std::fputs(command->text->c_str(), stdout);
    return 0;
  }
  SetLog(command->config);
  LiveConfig config(*command, read);
  config.AddPart(&PrepareLog);
  std::atomic<bool> has_failed = false;
  const int code = Serve(config, has_failed);
  return has_failed ? 1 : code;
}

}  // namespace
}  // namespace atlas

int main(int argc, char** argv) {
  try {
    return atlas::Main(argc, argv);
  } catch (const std::exception& error) {
    spdlog::critical("{}", error.what());
    return 1;
  }
}
