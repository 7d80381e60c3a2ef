#include "server/config/daemon_config.h"

#include <cmath>

#include "core/base/str_cat.h"
#include "server/config/setting_table.h"

namespace atlas {
namespace {

Status CheckListen(const DaemonConfig& config, const GivenSetting& listen) {
  if (config.is_loopback() || !config.tls_certificate.empty() || config.allow_plaintext) {
    return {};
  }
  return Status(
             StatusCode::kInvalidArgument,
             StrCat("listen is '", listen.text,
                    "', expected a loopback address, or TLS (tls.certificate, tls.key), or to be "
                    "told that the network may read along (access.allow_plaintext)"))
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

// What depends on more than one setting.
Status CheckTogether(const DaemonConfig& config, const GivenSettings& given) {
  if (const auto listen = given.find("listen"); listen != given.end()) {
    ATLAS_RETURN_IF_ERROR(CheckListen(config, listen->second));
  }
  return CheckSecurity(config);
}

}  // namespace

bool IsLoopback(const std::string& host) {
  return host == "::1" || host.starts_with("127.");
}

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
    if (Status status = SettingByKey(key).apply(key, setting.text, config); !status.ok()) {
      return Error(status.WithContext(setting.origin));
    }
  }
  if (const Status status = CheckTogether(config, given); !status.ok()) {
    return Error(status);
  }
  return config;
}

bool IsLiveSetting(const std::string& key) {
  return SettingByKey(key).is_live;
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

}  // namespace atlas
