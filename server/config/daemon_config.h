// What the daemon is told: flags > environment > file > default (docs/daemon.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "server/config/config_file.h"

namespace atlas {

// A numeric address of this machine alone.
bool IsLoopback(const std::string& host);

struct HostPort {
  std::string host;
  std::uint16_t port = 0;

  friend bool operator==(const HostPort&, const HostPort&) = default;
};

struct DaemonConfig {
  std::filesystem::path data;  // required
  std::string host = "127.0.0.1";
  std::uint16_t port = 7447;
  int workers = 0;                      // fusion threads; 0: one a core
  bool is_fusing = true;                // else dirty tiles wait for a daemon that does
  int fusion_nice = 10;                 // how far fusion threads stand back behind the others
  int network_threads = 0;              // that run connections; 0: one for every four cores
  int cache_mib = 512;                  // decoded keyframes, all workers together
  int survey_mib = 1024;                // what tiles keep from one fusion to the next
  int survey_disk_mib = 4096;           // the same on disk; 0: nothing
  int scrub_kib_per_s = 2048;           // that is read back to find damage; 0: nothing
  int scrub_hours = 24;                 // between two passes
  std::filesystem::path backup_folder;  // empty: no backups
  int backup_mib_per_s = 64;            // that are copied and read back; 0: no limit
  int reply_mib = 64;                   // tiles ready to be sent
  int queue_mib = 16;                   // replies that wait for slow readers
  int watch_mib = 64;                   // areas that are watched
  std::string log_level = "info";
  std::string log_format = "text";
  // Of one name, a certificate's or a token's, on all its connections; 0: no limit to a rate.
  int name_connections = 64;
  int name_held_mib = 128;  // of requests under way
  int name_requests_per_s = 1'000;
  int name_mib_per_s = 64;
  int name_served_mib_per_s = 256;
  int vehicle_sessions_per_hour = 1'000;  // that it may begin; 0: no limit
  // How much may be stored; 0: no limit.
  int store_mib = 0;           // the database
  int vehicle_mib = 0;         // keyframes of one vehicle
  int disk_floor_mib = 256;    // that stay free on the disk
  bool is_compacting = false;  // when the store is nearly full
  // How far keyframes that follow each other may be apart (core/geometry/plausibility.h).
  int quarantine_speed_mps = 90;  // 0: as far as they like, as with the climb
  int quarantine_jump_m = 50;
  int quarantine_climb_mps = 15;
  int quarantine_height_jump_m = 10;
  std::optional<HostPort> http;  // the operations port; none: off

  // Who comes in. PEM files; a certificate has a key, and makes the daemon speak TLS alone.
  std::filesystem::path tls_certificate;
  std::filesystem::path tls_key;
  std::filesystem::path tls_client_ca;   // of vehicles; empty: no certificate of a peer counts
  std::filesystem::path tokens;          // of people (token_list.h); empty: none
  std::optional<std::string> anonymous;  // the role of whoever shows neither
  bool allow_plaintext = false;          // off loopback, without TLS

  bool is_loopback() const;
  // "admin" where everybody is on this machine and nobody is expected to show anything, else
  // "none", unless it was given.
  std::string AnonymousRole() const;

  // Of the map, given by whoever starts the daemon; checked against an atlas that exists already.
  std::optional<double> cell_size_m;
  std::optional<int> segments;
  std::optional<double> segment_height_m;
  std::optional<std::string> preset;

  // The profile for a new atlas. kInvalidArgument on values out of range.
  Result<MapProfile> NewProfile() const;
  // kInvalidData naming the first map option given that differs from `existing`.
  Status CheckAgainst(const MapProfile& existing) const;

  friend bool operator==(const DaemonConfig&, const DaemonConfig&) = default;
};

using GivenSettings = std::map<std::string, GivenSetting>;  // by key in the file

// kInvalidArgument names where the value was given. What is not given has its default.
Result<DaemonConfig> ConfigFrom(const GivenSettings& given);
// It takes effect while the daemon runs; others need a restart.
bool IsLiveSetting(const std::string& key);

}  // namespace atlas
