#include "server/config/daemon_config.h"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <map>
#include <system_error>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "core/base/str_cat.h"
#include "server/config/config_file.h"

namespace atlas {
namespace {

using Settings = GivenSettings;

// Who adds one here gives it to a part of LiveConfig.
constexpr std::string_view kLiveSettings[] = {"access.anonymous",
                                              "access.tokens",
                                              "limits.connections_per_name",
                                              "limits.held_mib_per_name",
                                              "limits.mib_per_s_per_name",
                                              "limits.requests_per_s_per_name",
                                              "log_format",
                                              "log_level",
                                              "tls.certificate",
                                              "tls.client_ca",
                                              "tls.key"};

Status BadValue(const std::string& key, const std::string& text, const char* expected) {
  return Status(StatusCode::kInvalidArgument, StrCat(key, " is '", text, "', expected ", expected));
}

template <typename T>
std::optional<T> ParseNumber(const std::string& text) {
  T value{};
  const char* const end = text.data() + text.size();
  const auto [next, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && next == end ? std::optional<T>(value) : std::nullopt;
}

Status ApplyData(const std::string& /*key*/, const std::string& text, DaemonConfig& config) {
  config.data = text;
  return {};
}

bool IsLoopback(const std::string& host) {
  return host == "::1" || host.starts_with("127.");
}

Result<HostPort> ParseHostPort(const std::string& key, const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const auto port = colon == std::string::npos ? std::nullopt
                                               : ParseNumber<std::uint16_t>(text.substr(colon + 1));
  if (!port) {
    return Error(BadValue(key, text, "HOST:PORT, the port from 0 to 65535"));
  }
  HostPort address{text.substr(0, colon), *port};
  std::string& host = address.host;
  if (host == "localhost") {
    host = "127.0.0.1";
  }
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  return address;
}

Status ApplyHttp(const std::string& key, const std::string& text, DaemonConfig& config) {
  config.http.reset();
  if (text.empty()) {
    return {};
  }
  const Result<HostPort> address = ParseHostPort(key, text);
  if (!address) {
    return address.error();
  }
  if (!IsLoopback(address->host)) {
    return BadValue(key, text, "a loopback address: whoever reaches it sees how the daemon fares");
  }
  config.http = *address;
  return {};
}

Status ApplyListen(const std::string& key, const std::string& text, DaemonConfig& config) {
  const Result<HostPort> address = ParseHostPort(key, text);
  if (!address) {
    return address.error();
  }
  config.host = address->host;
  config.port = address->port;
  return {};
}

template <typename T>
Status ApplyNumber(const std::string& key, const std::string& text, std::optional<T>& value) {
  value = ParseNumber<T>(text);
  return value ? Status() : BadValue(key, text, "a number");
}

Status ApplyCount(const std::string& key, const std::string& text, int low, int high, int& value) {
  const auto number = ParseNumber<int>(text);
  if (!number || *number < low || *number > high) {
    return BadValue(key, text, StrCat("a whole number from ", low, " to ", high).c_str());
  }
  value = *number;
  return {};
}

Status ApplyLogLevel(const std::string& key, const std::string& text, DaemonConfig& config) {
  if (text != "debug" && text != "info" && text != "warning" && text != "error") {
    return BadValue(key, text, "debug, info, warning or error");
  }
  config.log_level = text;
  return {};
}

template <std::filesystem::path DaemonConfig::*kMember>
Status ApplyFile(const std::string& /*key*/, const std::string& text, DaemonConfig& config) {
  config.*kMember = text;
  return {};
}

Status ApplyAnonymous(const std::string& /*key*/, const std::string& text, DaemonConfig& config) {
  config.anonymous = text;
  return {};
}

template <bool DaemonConfig::*kMember>
Status ApplyTruth(const std::string& key, const std::string& text, DaemonConfig& config) {
  if (text != "true" && text != "false") {
    return BadValue(key, text, "true or false");
  }
  config.*kMember = text == "true";
  return {};
}

Status CheckListen(const DaemonConfig& config, const GivenSetting& listen) {
  if (config.is_loopback() || !config.tls_certificate.empty() || config.allow_plaintext) {
    return {};
  }
  return BadValue("listen", listen.text,
                  "a loopback address, or TLS (tls.certificate, tls.key), or to be told that the "
                  "network may read along (access.allow_plaintext)")
      .WithContext(listen.origin);
}

// Of all settings together.
Status CheckSecurity(const DaemonConfig& config) {
  const bool has_tls = !config.tls_certificate.empty();
  if (has_tls == config.tls_key.empty()) {
    return {StatusCode::kInvalidArgument,
            "tls.certificate and tls.key: one without the other is of no use"};
  }
  if (!has_tls && !config.tls_client_ca.empty()) {
    return {StatusCode::kInvalidArgument,
            "tls.client_ca: without tls.certificate no peer shows a certificate"};
  }
  if (config.AnonymousRole() == "none" && config.tls_client_ca.empty() && config.tokens.empty()) {
    return {StatusCode::kInvalidArgument,
            "nobody could come in: expected tls.client_ca, access.tokens or access.anonymous"};
  }
  return {};
}

Status ApplyLogFormat(const std::string& key, const std::string& text, DaemonConfig& config) {
  if (text != "text" && text != "json") {
    return BadValue(key, text, "text or json");
  }
  config.log_format = text;
  return {};
}

Status ApplyPreset(const std::string& /*key*/, const std::string& text, DaemonConfig& config) {
  if (!FusionPresetByName(text)) {
    return BadValue("preset", text, "strict, bounded or paper");
  }
  config.preset = text;
  return {};
}

struct Setting {
  const char* key;  // in the file
  const char* flag;
  const char* environment;
  const char* value;  // what kind of one, for --help
  const char* help;
  SettingType type;
  Status (*apply)(const std::string& key, const std::string& text, DaemonConfig& config);
};

template <int DaemonConfig::*kMember, int kLow, int kHigh>
Status ApplyCountTo(const std::string& key, const std::string& text, DaemonConfig& config) {
  return ApplyCount(key, text, kLow, kHigh, config.*kMember);
}

template <typename T, std::optional<T> DaemonConfig::*kMember>
Status ApplyNumberTo(const std::string& key, const std::string& text, DaemonConfig& config) {
  return ApplyNumber(key, text, config.*kMember);
}

constexpr Setting kSettings[] = {
    {"data", "--data", "ATLASD_DATA", "DIR", "directory of the atlas; made if there is none",
     SettingType::kText, &ApplyData},
    {"listen", "--listen", "ATLASD_LISTEN", "HOST:PORT",
     "port 0 takes a free one; beyond loopback TLS is expected", SettingType::kText, &ApplyListen},
    {"workers", "--workers", "ATLASD_WORKERS", "N", "fusion threads; 0 is one a core",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::workers, 0, 64>},
    {"fusion.enabled", "--fusion", "ATLASD_FUSION", "BOOL",
     "false: take uploads and leave their tiles dirty", SettingType::kTruth,
     &ApplyTruth<&DaemonConfig::is_fusing>},
    {"fusion.nice", "--fusion-nice", "ATLASD_FUSION_NICE", "N",
     "steps of nice by which fusion threads stand back", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::fusion_nice, 0, 19>},
    {"network_threads", "--network-threads", "ATLASD_NETWORK_THREADS", "N",
     "threads that run connections; 0 is one for every four cores", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::network_threads, 0, 64>},
    {"cache_mib", "--cache-mib", "ATLASD_CACHE_MIB", "MIB", "memory for decoded keyframes",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::cache_mib, 8, 65'536>},
    {"survey_mib", "--survey-mib", "ATLASD_SURVEY_MIB", "MIB",
     "memory for what tiles keep from one fusion to the next", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::survey_mib, 0, 1'048'576>},
    {"survey_disk_mib", "--survey-disk-mib", "ATLASD_SURVEY_DISK_MIB", "MIB",
     "disk for the same, where memory has no room and after a restart", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::survey_disk_mib, 0, 16'777'216>},
    {"reply_mib", "--reply-mib", "ATLASD_REPLY_MIB", "MIB", "memory for tiles ready to be sent",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::reply_mib, 0, 65'536>},
    {"limits.connections_per_name", "--connections-per-name", "ATLASD_CONNECTIONS_PER_NAME", "N",
     "connections of one certificate's or token's name", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::name_connections, 1, 4'096>},
    {"limits.held_mib_per_name", "--held-mib-per-name", "ATLASD_HELD_MIB_PER_NAME", "MIB",
     "its requests under way", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::name_held_mib, 48, 512>},
    {"limits.requests_per_s_per_name", "--requests-per-s-per-name",
     "ATLASD_REQUESTS_PER_S_PER_NAME", "N", "its requests a second; 0: no limit",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::name_requests_per_s, 0, 10'000'000>},
    {"limits.mib_per_s_per_name", "--mib-per-s-per-name", "ATLASD_MIB_PER_S_PER_NAME", "MIB",
     "what it sends a second; 0: no limit", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::name_mib_per_s, 0, 65'536>},
    {"log_level", "--log-level", "ATLASD_LOG_LEVEL", "LEVEL", "debug, info, warning or error",
     SettingType::kText, &ApplyLogLevel},
    {"log_format", "--log-format", "ATLASD_LOG_FORMAT", "NAME", "text, or json: an object a line",
     SettingType::kText, &ApplyLogFormat},
    {"http", "--http", "ATLASD_HTTP", "HOST:PORT",
     "health and metrics, loopback only; port 0 takes a free one", SettingType::kText, &ApplyHttp},
    {"tls.certificate", "--tls-certificate", "ATLASD_TLS_CERTIFICATE", "FILE",
     "PEM: the daemon's certificate and those above it; speak TLS 1.3 alone", SettingType::kText,
     &ApplyFile<&DaemonConfig::tls_certificate>},
    {"tls.key", "--tls-key", "ATLASD_TLS_KEY", "FILE", "PEM: its private key", SettingType::kText,
     &ApplyFile<&DaemonConfig::tls_key>},
    {"tls.client_ca", "--tls-client-ca", "ATLASD_TLS_CLIENT_CA", "FILE",
     "PEM: who vouches for vehicles", SettingType::kText, &ApplyFile<&DaemonConfig::tls_client_ca>},
    {"access.tokens", "--tokens", "ATLASD_TOKENS", "FILE", "tokens of people", SettingType::kText,
     &ApplyFile<&DaemonConfig::tokens>},
    {"access.anonymous", "--anonymous", "ATLASD_ANONYMOUS", "ROLE",
     "of whoever shows nothing: none, reader, vehicle, merge or admin", SettingType::kText,
     &ApplyAnonymous},
    {"access.allow_plaintext", "--allow-plaintext", "ATLASD_ALLOW_PLAINTEXT", "BOOL",
     "listen beyond loopback without TLS", SettingType::kTruth,
     &ApplyTruth<&DaemonConfig::allow_plaintext>},
    {"map.cell_size", "--cell-size", "ATLASD_CELL_SIZE", "M", "new atlas: side of a cell",
     SettingType::kNumber, &ApplyNumberTo<double, &DaemonConfig::cell_size_m>},
    {"map.segments", "--segments", "ATLASD_SEGMENTS", "N",
     "new atlas: segments a column: 2, 4, 8 or 16", SettingType::kNumber,
     &ApplyNumberTo<int, &DaemonConfig::segments>},
    {"map.segment_height", "--segment-height", "ATLASD_SEGMENT_HEIGHT", "M",
     "new atlas: height of a segment", SettingType::kNumber,
     &ApplyNumberTo<double, &DaemonConfig::segment_height_m>},
    {"map.preset", "--preset", "ATLASD_PRESET", "NAME",
     "new atlas: fusion preset: strict, bounded or paper", SettingType::kText, &ApplyPreset},
};

// What each setting is when it is not given, for --help.
std::map<std::string, std::string> Defaults() {
  const DaemonConfig config;
  const MapProfile map;
  return {{"data", "must be given"},
          {"listen", StrCat(config.host, ":", config.port)},
          {"workers", StrCat(config.workers)},
          {"fusion.enabled", config.is_fusing ? "true" : "false"},
          {"fusion.nice", StrCat(config.fusion_nice)},
          {"network_threads", StrCat(config.network_threads)},
          {"cache_mib", StrCat(config.cache_mib)},
          {"survey_mib", StrCat(config.survey_mib)},
          {"survey_disk_mib", StrCat(config.survey_disk_mib)},
          {"reply_mib", StrCat(config.reply_mib)},
          {"limits.connections_per_name", StrCat(config.name_connections)},
          {"limits.held_mib_per_name", StrCat(config.name_held_mib)},
          {"limits.requests_per_s_per_name", StrCat(config.name_requests_per_s)},
          {"limits.mib_per_s_per_name", StrCat(config.name_mib_per_s)},
          {"log_level", config.log_level},
          {"log_format", config.log_format},
          {"http", "off"},
          {"tls.certificate", "none"},
          {"tls.key", "none"},
          {"tls.client_ca", "none"},
          {"access.tokens", "none"},
          {"access.anonymous", "admin on loopback without tokens and client_ca, else none"},
          {"access.allow_plaintext", "false"},
          {"map.cell_size", StrCat(map.cell_size_m())},
          {"map.segments", StrCat(int{map.column_segments})},
          {"map.segment_height", StrCat(map.segment_height_m())},
          {"map.preset", StrCat(FusionPresetName(map.preset))}};
}

Status Apply(const std::string& key, const std::string& text, DaemonConfig& config) {
  const auto* const setting =
      std::find_if(std::begin(kSettings), std::end(kSettings),
                   [&key](const Setting& candidate) { return candidate.key == key; });
  assert(setting != std::end(kSettings));  // whoever collects them refuses others
  return setting->apply(key, text, config);
}

// File, then environment, then flags: later ones win.
Result<Settings> Collect(const Settings& flags, const std::string& file) {
  std::map<std::string, SettingType> types;
  for (const Setting& setting : kSettings) {
    types[setting.key] = setting.type;
  }
  Settings settings;
  if (!file.empty()) {
    Result<Settings> read = ReadConfigFile(file, types);
    if (!read) {
      return read;
    }
    settings = std::move(*read);
  }
  for (const Setting& setting : kSettings) {
    if (const char* value = std::getenv(setting.environment); value != nullptr) {
      settings[setting.key] = {value, setting.environment};
    }
  }
  for (const auto& [key, given] : flags) {
    settings[key] = given;
  }
  return settings;
}

}  // namespace

bool DaemonConfig::is_loopback() const {
  return IsLoopback(host);
}

std::string DaemonConfig::AnonymousRole() const {
  const bool is_private = is_loopback() && tls_client_ca.empty() && tokens.empty();
  return anonymous.value_or(is_private ? "admin" : "none");
}

Result<DaemonConfig> ConfigFrom(const GivenSettings& given) {
  DaemonConfig config;
  for (const auto& [key, setting] : given) {
    if (Status status = Apply(key, setting.text, config); !status.ok()) {
      return Error(status.WithContext(setting.origin));
    }
  }
  if (const auto listen = given.find("listen"); listen != given.end()) {
    if (Status status = CheckListen(config, listen->second); !status.ok()) {
      return Error(std::move(status));
    }
  }
  if (Status status = CheckSecurity(config); !status.ok()) {
    return Error(std::move(status));
  }
  return config;
}

bool IsLiveSetting(const std::string& key) {
  return std::find(std::begin(kLiveSettings), std::end(kLiveSettings), key) !=
         std::end(kLiveSettings);
}

Result<MapProfile> DaemonConfig::NewProfile() const {
  MapProfile profile;
  if (cell_size_m) {
    profile.cell_size_um = static_cast<std::uint32_t>(std::llround(*cell_size_m * 1e6));
  }
  if (segments) {
    profile.column_segments = static_cast<std::uint8_t>(*segments);
  }
  if (segment_height_m) {
    profile.segment_height_mm = static_cast<std::uint16_t>(std::llround(*segment_height_m * 1e3));
  }
  if (preset) {
    profile.preset = *FusionPresetByName(*preset);  // checked when it was given
  }
  const bool is_sane =
      (!cell_size_m || (*cell_size_m > 0.0 && *cell_size_m <= 100.0)) &&
      (!segments || (*segments > 0 && *segments <= 16)) &&
      (!segment_height_m || (*segment_height_m > 0.0 && *segment_height_m <= 60.0));
  if (!is_sane) {
    return Error(StatusCode::kInvalidArgument,
                 "map: expected a cell size of 0.02 to 1 m, 2, 4, 8 or 16 segments of 0.1 to 4 m");
  }
  if (Status status = profile.Validate(); !status.ok()) {
    return Error(std::move(status));
  }
  return profile;
}

Status DaemonConfig::CheckAgainst(const MapProfile& existing) const {
  const Result<MapProfile> asked = NewProfile();
  if (!asked) {
    return asked.error();
  }
  const auto differs = [](const char* what, const auto& have, const auto& want) {
    return Status(StatusCode::kInvalidData, StrCat("the atlas has a ", what, " of ", have, ", not ",
                                                   want, ": it is fixed when an atlas is made"));
  };
  if (cell_size_m && asked->cell_size_um != existing.cell_size_um) {
    return differs("cell size", existing.cell_size_m(), *cell_size_m);
  }
  if (segments && asked->column_segments != existing.column_segments) {
    return differs("number of segments", existing.column_segments, *segments);
  }
  if (segment_height_m && asked->segment_height_mm != existing.segment_height_mm) {
    return differs("segment height", existing.segment_height_m(), *segment_height_m);
  }
  if (preset && asked->preset != existing.preset) {
    return differs("preset", FusionPresetName(existing.preset), *preset);
  }
  return {};
}

Result<DaemonCommand> ParseDaemonCommand(int argc, const char* const* argv) {
  CLI::App app("atlasd: the Road Atlas map server", "atlasd");
  app.set_version_flag("--version", "atlasd " ATLAS_VERSION);
  Settings flags;
  std::string file;
  app.add_option("--config", file, "TOML file with these settings")->type_name("FILE");
  const std::map<std::string, std::string> defaults = Defaults();
  for (const Setting& setting : kSettings) {
    CLI::Option* option = app.add_option_function<std::string>(
        setting.flag,
        [&flags, &setting](const std::string& value) {
          flags[setting.key] = {value, setting.flag};
        },
        StrCat(setting.help, " [", defaults.at(setting.key), "]"));
    option->type_name(setting.value);
  }
  DaemonCommand command;
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    command.text = app.help();
    return command;
  } catch (const CLI::CallForVersion&) {
    command.text = app.version() + "\n";
    return command;
  } catch (const CLI::ParseError& error) {
    return Error(StatusCode::kInvalidArgument, error.what());
  }
  Result<Settings> settings = Collect(flags, file);
  if (!settings) {
    return Error(settings.error());
  }
  Result<DaemonConfig> config = ConfigFrom(*settings);
  if (!config) {
    return Error(config.error());
  }
  command.config = *std::move(config);
  command.given = *std::move(settings);
  if (command.config.data.empty()) {
    return Error(StatusCode::kInvalidArgument, "--data DIR is required");
  }
  return command;
}

}  // namespace atlas
