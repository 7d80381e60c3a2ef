// atlasd: opens the store, starts fusion, serves until it is told to stop.

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "core/base/str_cat.h"
#include "server/base/log_format.h"
#include "server/config/daemon_command.h"
#include "server/config/live_config.h"
#include "server/hangup_watch.h"
#include "server/net/tcp_server.h"
#include "server/operations_port.h"
#include "server/service/atlas_service.h"
#include "server/service/process_memory.h"
#include "server/store/sqlite/sqlite_store.h"

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

std::array<std::uint8_t, 16> RandomId() {
  std::random_device random;
  std::array<std::uint8_t, 16> id{};
  for (std::uint8_t& byte : id) {
    byte = static_cast<std::uint8_t>(random());
  }
  return id;
}

Result<std::unique_ptr<AtlasStore>> OpenStore(const DaemonConfig& config) {
  const Result<MapProfile> profile = config.NewProfile();
  if (!profile) {
    return Error(profile.error());
  }
  SqliteStoreOptions options;
  options.directory = config.data;
  options.new_profile = *profile;
  options.new_atlas_id = RandomId();
  Result<std::unique_ptr<AtlasStore>> store = OpenSqliteStore(options);
  if (store) {
    if (Status status = config.CheckAgainst((*store)->identity().profile); !status.ok()) {
      return Error(std::move(status));
    }
  }
  return store;
}

unsigned WorkersFrom(const DaemonConfig& config) {
  if (!config.is_fusing) {
    return 0;
  }
  return config.workers > 0 ? static_cast<unsigned>(config.workers)
                            : std::max(1U, std::thread::hardware_concurrency());
}

ServiceOptions ServiceFrom(const DaemonConfig& config) {
  ServiceOptions options;
  options.fusion.workers = WorkersFrom(config);
  options.fusion.nice = config.fusion_nice;
  options.fusion.building.keyframe_bytes = static_cast<std::size_t>(config.cache_mib) << 20;
  options.fusion.building.surveys =
      SurveyCacheLimits::OfTotal(static_cast<std::size_t>(config.survey_mib) << 20);
  options.fusion.building.survey_files.directory = config.data / "surveys";
  options.fusion.building.survey_files.max_bytes = static_cast<std::size_t>(config.survey_disk_mib)
                                                   << 20;
  options.scratch_directory = config.data;
  return options;
}

NameLimits NameLimitsFrom(const DaemonConfig& config) {
  NameLimits limits;
  limits.connections = static_cast<std::size_t>(config.name_connections);
  limits.held_bytes = static_cast<std::size_t>(config.name_held_mib) << 20;
  limits.requests_per_s = config.name_requests_per_s;
  limits.bytes_per_s = config.name_mib_per_s * double{1u << 20};
  return limits;
}

NetOptions NetFrom(const DaemonConfig& config) {
  NetOptions options;
  options.threads = config.network_threads > 0
                        ? config.network_threads
                        : std::max(1, static_cast<int>(std::thread::hardware_concurrency() / 4));
  options.of_name = NameLimitsFrom(config);
  options.tile_frame_bytes = static_cast<std::size_t>(config.reply_mib) << 20;
  return options;
}

Result<ServerSecurity> SecurityFrom(const DaemonConfig& config) {
  const std::optional<Role> anonymous = RoleByName(config.AnonymousRole());
  if (!anonymous) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("access.anonymous is '", config.AnonymousRole(),
                        "', expected none, reader, vehicle, merge or admin"));
  }
  TokenList tokens;
  if (!config.tokens.empty()) {
    Result<TokenList> read = TokenList::Read(config.tokens);
    if (!read) {
      return Error(read.error());
    }
    tokens = *std::move(read);
  }
  ServerSecurity security;
  security.access = std::make_shared<const AccessControl>(std::move(tokens), *anonymous);
  if (!config.tls_certificate.empty()) {
    auto tls = TlsContext::Load({config.tls_certificate, config.tls_key, config.tls_client_ca});
    if (!tls) {
      return Error(tls.error());
    }
    security.tls = *std::move(tls);
  }
  return security;
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

void ReloadConfig(LiveConfig& config) {
  const Result<LiveConfig::Outcome> outcome = config.Reload();
  if (!outcome) {
    spdlog::error("signal 1: the new configuration is refused, the old one stays: {}: {}",
                  StatusCodeName(outcome.error().code()), outcome.error().message());
    return;
  }
  spdlog::info("signal 1: configuration read again, {} changed",
               outcome->changed.empty() ? "nothing" : Joined(outcome->changed));
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

int Serve(LiveConfig& live) {
  const DaemonConfig config = live.config();
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
  Result<std::unique_ptr<AtlasStore>> store = OpenStore(config);
  if (!store) {
    return Fail(store.error());
  }
  AtlasService service(**store, &NowMs, &Log, ServiceFrom(config));
  const std::string address = socket->address();
  TcpServer server(service, NetFrom(config), *std::move(socket), *std::move(security));
  std::printf("listening %s\n", address.c_str());
  std::optional<OperationsPort> operations;
  if (*http_socket) {
    std::printf("http %s\n", (*http_socket)->address().c_str());
    operations.emplace(service, **store, server, **std::move(http_socket));
  }
  live.AddPart(PrepareSecurity(server, !config.tls_certificate.empty()));
  live.AddPart(PrepareNameLimits(server));
  const HangupWatch hangups([&live] { ReloadConfig(live); });
  std::fflush(stdout);
  spdlog::info("atlas in {}", config.data.string());
  server.Run();
  service.Stop();
  spdlog::info("stopped");
  return 0;
}

int Main(int argc, const char* const* argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("atlasd"));
  std::signal(SIGHUP, SIG_IGN);  // until there is something that takes new settings
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
  return Serve(config);
}

}  // namespace
}  // namespace atlas

int main(int argc, char** argv) {
  atlas::ReturnLargeBlocks();
  try {
    return atlas::Main(argc, argv);
  } catch (const std::exception& error) {
    spdlog::critical("{}", error.what());
    return 1;
  }
}
