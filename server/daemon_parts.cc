#include "server/daemon_parts.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <random>
#include <system_error>
#include <thread>
#include <utility>

#include <spdlog/spdlog.h>

#include "core/base/str_cat.h"
#include "server/store/sqlite/sqlite_store.h"

namespace atlas {
namespace {

std::array<std::uint8_t, 16> RandomId() {
  std::random_device random;
  std::array<std::uint8_t, 16> id{};
  for (std::uint8_t& byte : id) {
    byte = static_cast<std::uint8_t>(random());
  }
  return id;
}

unsigned WorkersFrom(const DaemonConfig& config) {
  if (!config.is_fusing) {
    return 0;
  }
  return config.workers > 0 ? static_cast<unsigned>(config.workers)
                            : std::max(1U, std::thread::hardware_concurrency());
}

// Names of backups would be names of the atlas's own files.
Status CheckBackupFolder(const DaemonConfig& config) {
  std::error_code error;
  const bool is_data = !config.backup_folder.empty() &&
                       std::filesystem::equivalent(config.backup_folder, config.data, error);
  return is_data ? Status(StatusCode::kInvalidArgument,
                          StrCat("backup.folder is the data directory ", config.data.string(),
                                 ", expected another folder"))
                 : Status();
}

}  // namespace

Result<std::unique_ptr<AtlasStore>> OpenStore(const DaemonConfig& config,
                                              std::function<void(const Status&)> on_failed_sync) {
  const Result<MapProfile> profile = config.NewProfile();
  if (!profile) {
    return Error(profile.error());
  }
  if (Status status = CheckBackupFolder(config); !status.ok()) {
    return Error(std::move(status));
  }
  SqliteStoreOptions options;
  options.directory = config.data;
  options.new_profile = *profile;
  options.new_atlas_id = RandomId();
  options.on_failed_sync = std::move(on_failed_sync);
  options.on_upgrade = [](std::int64_t from) {
    spdlog::info("the atlas is of schema version {}: upgrading it, before anybody is served", from);
  };
  options.on_damaged_log = [](const std::string& what) {
    spdlog::error("{}", what);
  };
  options.on_repair = [](const std::string& what) {
    spdlog::error("damage was put right: {}", what);
  };
  Result<std::unique_ptr<AtlasStore>> store = OpenSqliteStore(options);
  if (store) {
    if (Status status = config.CheckAgainst((*store)->identity().profile); !status.ok()) {
      return Error(std::move(status));
    }
  }
  return store;
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
  options.scrub.bytes_per_s = config.scrub_kib_per_s * 1024.0;
  options.scrub.checks_indexes = true;
  options.scrub.between = std::chrono::hours(config.scrub_hours);
  options.sessions_per_hour = static_cast<std::uint32_t>(config.vehicle_sessions_per_hour);
  options.retention.limits.store_bytes = static_cast<std::uint64_t>(config.store_mib) << 20;
  options.retention.limits.vehicle_bytes = static_cast<std::uint64_t>(config.vehicle_mib) << 20;
  options.retention.limits.disk_floor_bytes = static_cast<std::uint64_t>(config.disk_floor_mib)
                                              << 20;
  options.retention.is_compacting = config.is_compacting;
  options.plausibility.max_speed_mps = config.quarantine_speed_mps;
  options.plausibility.max_jump_m = config.quarantine_jump_m;
  options.plausibility.max_climb_mps = config.quarantine_climb_mps;
  options.plausibility.max_height_jump_m = config.quarantine_height_jump_m;
  options.backup.folder = config.backup_folder;
  options.backup.bytes_per_s = config.backup_mib_per_s * double{1u << 20};
  options.scratch_directory = config.data;
  return options;
}

NameLimits NameLimitsFrom(const DaemonConfig& config) {
  NameLimits limits;
  limits.connections = static_cast<std::size_t>(config.name_connections);
  limits.held_bytes = static_cast<std::size_t>(config.name_held_mib) << 20;
  limits.requests_per_s = config.name_requests_per_s;
  limits.bytes_per_s = config.name_mib_per_s * double{1u << 20};
  limits.served_bytes_per_s = config.name_served_mib_per_s * double{1u << 20};
  limits.watched_bytes = std::max(static_cast<std::size_t>(config.watch_mib) << 18,
                                  NetOptions().max_connection_watched_bytes);
  return limits;
}

NetOptions NetFrom(const DaemonConfig& config) {
  NetOptions options;
  options.threads = config.network_threads > 0
                        ? config.network_threads
                        : std::max(1, static_cast<int>(std::thread::hardware_concurrency() / 4));
  options.of_name = NameLimitsFrom(config);
  options.tile_frame_bytes = static_cast<std::size_t>(config.reply_mib) << 20;
  options.max_all_queued_bytes = static_cast<std::size_t>(config.queue_mib) << 20;
  options.max_watched_bytes = static_cast<std::size_t>(config.watch_mib) << 20;
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

}  // namespace atlas
