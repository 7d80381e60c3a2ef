#include "server/config/setting_table.h"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <iterator>
#include <optional>
#include <system_error>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

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

// In thousandths, so that a template can say the range.
template <std::optional<double> DaemonConfig::*kMember, int kLowMilli, int kHighMilli>
Status ApplyMetres(const std::string& key, const std::string& text, DaemonConfig& config) {
  constexpr double kLow = kLowMilli / 1e3;
  constexpr double kHigh = kHighMilli / 1e3;
  const auto number = ParseNumber<double>(text);
  if (!number || !(*number >= kLow && *number <= kHigh)) {  // NaN is in no range
    return BadValue(key, text, StrCat("metres from ", kLow, " to ", kHigh).c_str());
  }
  config.*kMember = *number;
  return {};
}

Status ApplySegments(const std::string& key, const std::string& text, DaemonConfig& config) {
  const auto number = ParseNumber<int>(text);
  if (!number || (*number != 2 && *number != 4 && *number != 8 && *number != 16)) {
    return BadValue(key, text, "2, 4, 8 or 16");
  }
  config.segments = *number;
  return {};
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

template <int DaemonConfig::*kMember, int kLow, int kHigh>
Status ApplyCountTo(const std::string& key, const std::string& text, DaemonConfig& config) {
  return ApplyCount(key, text, kLow, kHigh, config.*kMember);
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
    {"scrub.kib_per_s", "--scrub-kib-per-s", "ATLASD_SCRUB_KIB_PER_S", "KIB",
     "pace at which all is read back to find damage; 0 is not at all", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::scrub_kib_per_s, 0, 16'777'216>},
    {"scrub.hours", "--scrub-hours", "ATLASD_SCRUB_HOURS", "H",
     "from the end of a pass of that to the next", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::scrub_hours, 0, 8'760>},
    {"backup.folder", "--backup-folder", "ATLASD_BACKUP_FOLDER", "DIR",
     "folder for backups, which must be there", SettingType::kText,
     &ApplyFile<&DaemonConfig::backup_folder>},
    {"backup.mib_per_s", "--backup-mib-per-s", "ATLASD_BACKUP_MIB_PER_S", "MIB",
     "pace of a backup; 0: no limit", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::backup_mib_per_s, 0, 65'536>},
    {"reply_mib", "--reply-mib", "ATLASD_REPLY_MIB", "MIB", "memory for tiles ready to be sent",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::reply_mib, 0, 65'536>},
    {"queue_mib", "--queue-mib", "ATLASD_QUEUE_MIB", "MIB",
     "memory for replies that wait for slow readers", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::queue_mib, 8, 65'536>},
    {"watch_mib", "--watch-mib", "ATLASD_WATCH_MIB", "MIB", "memory for areas that are watched",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::watch_mib, 2, 1'024>},
    {"limits.connections_per_name", "--connections-per-name", "ATLASD_CONNECTIONS_PER_NAME", "N",
     "connections of one certificate's or token's name", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::name_connections, 1, 4'096>, true},
    {"limits.held_mib_per_name", "--held-mib-per-name", "ATLASD_HELD_MIB_PER_NAME", "MIB",
     "its requests under way", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::name_held_mib, 48, 512>, true},
    {"limits.requests_per_s_per_name", "--requests-per-s-per-name",
     "ATLASD_REQUESTS_PER_S_PER_NAME", "N", "its requests a second; 0: no limit",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::name_requests_per_s, 0, 10'000'000>, true},
    {"limits.mib_per_s_per_name", "--mib-per-s-per-name", "ATLASD_MIB_PER_S_PER_NAME", "MIB",
     "what it sends a second; 0: no limit", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::name_mib_per_s, 0, 65'536>, true},
    {"limits.served_mib_per_s_per_name", "--served-mib-per-s-per-name",
     "ATLASD_SERVED_MIB_PER_S_PER_NAME", "MIB", "what it is sent a second; 0: no limit",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::name_served_mib_per_s, 0, 65'536>, true},
    {"limits.sessions_per_hour_per_vehicle", "--sessions-per-hour-per-vehicle",
     "ATLASD_SESSIONS_PER_HOUR_PER_VEHICLE", "N",
     "sessions that one vehicle may begin an hour; 0: no limit", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::vehicle_sessions_per_hour, 0, 1'000'000>, true},
    {"retention.store_mib", "--store-mib", "ATLASD_STORE_MIB", "MIB",
     "the atlas's database may grow to so much by uploads; 0: no limit", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::store_mib, 0, 1'073'741'824>, true},
    {"retention.vehicle_mib", "--vehicle-mib", "ATLASD_VEHICLE_MIB", "MIB",
     "stored keyframes of one vehicle; 0: no limit", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::vehicle_mib, 0, 1'073'741'824>, true},
    {"retention.disk_floor_mib", "--disk-floor-mib", "ATLASD_DISK_FLOOR_MIB", "MIB",
     "below so much free disk uploads are refused; 0: as long as there is any",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::disk_floor_mib, 0, 16'777'216>, true},
    {"retention.compact", "--compact", "ATLASD_COMPACT", "BOOL",
     "drop the oldest keyframes that matter nowhere when store_mib is nearly reached",
     SettingType::kTruth, &ApplyTruth<&DaemonConfig::is_compacting>, true},
    {"quarantine.max_speed_mps", "--quarantine-max-speed-mps", "ATLASD_QUARANTINE_MAX_SPEED_MPS",
     "MPS", "a session with two keyframes farther apart is kept out of the map; 0: as far as it is",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::quarantine_speed_mps, 0, 1'000'000>, true},
    {"quarantine.max_jump_m", "--quarantine-max-jump-m", "ATLASD_QUARANTINE_MAX_JUMP_M", "M",
     "how much farther they may be", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::quarantine_jump_m, 0, 1'000'000>, true},
    {"quarantine.max_climb_mps", "--quarantine-max-climb-mps", "ATLASD_QUARANTINE_MAX_CLIMB_MPS",
     "MPS", "the same up or down; 0: as far as it is", SettingType::kNumber,
     &ApplyCountTo<&DaemonConfig::quarantine_climb_mps, 0, 1'000'000>, true},
    {"quarantine.max_height_jump_m", "--quarantine-max-height-jump-m",
     "ATLASD_QUARANTINE_MAX_HEIGHT_JUMP_M", "M", "how much farther up or down",
     SettingType::kNumber, &ApplyCountTo<&DaemonConfig::quarantine_height_jump_m, 0, 1'000'000>,
     true},
    {"log_level", "--log-level", "ATLASD_LOG_LEVEL", "LEVEL", "debug, info, warning or error",
     SettingType::kText, &ApplyLogLevel, true},
    {"log_format", "--log-format", "ATLASD_LOG_FORMAT", "NAME", "text, or json: an object a line",
     SettingType::kText, &ApplyLogFormat, true},
    {"http", "--http", "ATLASD_HTTP", "HOST:PORT",
     "health and metrics, loopback only; port 0 takes a free one", SettingType::kText, &ApplyHttp},
    {"tls.certificate", "--tls-certificate", "ATLASD_TLS_CERTIFICATE", "FILE",
     "PEM: the daemon's certificate and those above it; speak TLS 1.3 alone", SettingType::kText,
     &ApplyFile<&DaemonConfig::tls_certificate>, true, &DaemonConfig::tls_certificate},
    {"tls.key", "--tls-key", "ATLASD_TLS_KEY", "FILE", "PEM: its private key", SettingType::kText,
     &ApplyFile<&DaemonConfig::tls_key>, true, &DaemonConfig::tls_key},
    {"tls.client_ca", "--tls-client-ca", "ATLASD_TLS_CLIENT_CA", "FILE",
     "PEM: who vouches for vehicles", SettingType::kText, &ApplyFile<&DaemonConfig::tls_client_ca>,
     true, &DaemonConfig::tls_client_ca},
    {"access.tokens", "--tokens", "ATLASD_TOKENS", "FILE", "tokens of people", SettingType::kText,
     &ApplyFile<&DaemonConfig::tokens>, true, &DaemonConfig::tokens},
    {"access.anonymous", "--anonymous", "ATLASD_ANONYMOUS", "ROLE",
     "of whoever shows nothing: none, reader, vehicle, merge or admin", SettingType::kText,
     &ApplyAnonymous, true},
    {"access.allow_plaintext", "--allow-plaintext", "ATLASD_ALLOW_PLAINTEXT", "BOOL",
     "listen beyond loopback without TLS", SettingType::kTruth,
     &ApplyTruth<&DaemonConfig::allow_plaintext>},
    {"map.cell_size", "--cell-size", "ATLASD_CELL_SIZE", "M", "new atlas: side of a cell",
     SettingType::kNumber, &ApplyMetres<&DaemonConfig::cell_size_m, 20, 1'000>},
    {"map.segments", "--segments", "ATLASD_SEGMENTS", "N",
     "new atlas: segments a column: 2, 4, 8 or 16", SettingType::kNumber, &ApplySegments},
    {"map.segment_height", "--segment-height", "ATLASD_SEGMENT_HEIGHT", "M",
     "new atlas: height of a segment", SettingType::kNumber,
     &ApplyMetres<&DaemonConfig::segment_height_m, 100, 4'000>},
    {"map.preset", "--preset", "ATLASD_PRESET", "NAME",
     "new atlas: fusion preset: strict, bounded or paper", SettingType::kText, &ApplyPreset},
};

}  // namespace

std::span<const Setting> AllSettings() {
  return kSettings;
}

const Setting& SettingByKey(const std::string& key) {
  const auto* const setting =
      std::find_if(std::begin(kSettings), std::end(kSettings),
                   [&key](const Setting& candidate) { return candidate.key == key; });
  assert(setting != std::end(kSettings));  // whoever collects them refuses others
  return *setting;
}

std::map<std::string, std::string> SettingDefaults() {
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
          {"scrub.kib_per_s", StrCat(config.scrub_kib_per_s)},
          {"scrub.hours", StrCat(config.scrub_hours)},
          {"backup.folder", "none"},
          {"backup.mib_per_s", StrCat(config.backup_mib_per_s)},
          {"reply_mib", StrCat(config.reply_mib)},
          {"queue_mib", StrCat(config.queue_mib)},
          {"watch_mib", StrCat(config.watch_mib)},
          {"limits.connections_per_name", StrCat(config.name_connections)},
          {"limits.held_mib_per_name", StrCat(config.name_held_mib)},
          {"limits.requests_per_s_per_name", StrCat(config.name_requests_per_s)},
          {"limits.mib_per_s_per_name", StrCat(config.name_mib_per_s)},
          {"limits.served_mib_per_s_per_name", StrCat(config.name_served_mib_per_s)},
          {"limits.sessions_per_hour_per_vehicle", StrCat(config.vehicle_sessions_per_hour)},
          {"retention.store_mib", StrCat(config.store_mib)},
          {"retention.vehicle_mib", StrCat(config.vehicle_mib)},
          {"retention.disk_floor_mib", StrCat(config.disk_floor_mib)},
          {"retention.compact", config.is_compacting ? "true" : "false"},
          {"quarantine.max_speed_mps", StrCat(config.quarantine_speed_mps)},
          {"quarantine.max_jump_m", StrCat(config.quarantine_jump_m)},
          {"quarantine.max_climb_mps", StrCat(config.quarantine_climb_mps)},
          {"quarantine.max_height_jump_m", StrCat(config.quarantine_height_jump_m)},
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

}  // namespace atlas
