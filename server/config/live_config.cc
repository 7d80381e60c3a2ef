#include "server/config/live_config.h"

#include <set>

#include "server/config/setting_table.h"

namespace atlas {
namespace {

// The defaults but for one setting, whether it makes sense alone or not: a certificate without its
// key does not.
Result<DaemonConfig> WithOnly(const GivenSettings& given, const std::string& key) {
  DaemonConfig config;
  if (const auto found = given.find(key); found != given.end()) {
    Status status = SettingByKey(key).apply(key, found->second.text, config);
    if (!status.ok()) {
      return Error(std::move(status));
    }
  }
  return config;
}

// Keys whose values differ, however they are written.
std::vector<std::string> Differences(const GivenSettings& before, const GivenSettings& after) {
  std::set<std::string> keys;
  for (const GivenSettings& given : {before, after}) {
    for (const auto& [key, setting] : given) {
      keys.insert(key);
    }
  }
  std::vector<std::string> differing;
  for (const std::string& key : keys) {
    if (WithOnly(before, key) != WithOnly(after, key)) {
      differing.push_back(key);
    }
  }
  return differing;
}

void TakeOver(const std::string& key, const GivenSettings& from, GivenSettings& to) {
  to.erase(key);
  if (const auto found = from.find(key); found != from.end()) {
    to.insert(*found);
  }
}

}  // namespace

Result<LiveConfig::Outcome> LiveConfig::Reload() {
  const Result<DaemonCommand> command = read_();
  if (!command) {
    return Error(command.error());
  }
  if (const auto profile = command->config.NewProfile(); !profile) {
    return Error(profile.error());
  }
  Outcome outcome;
  GivenSettings merged = running_.given;
  for (const std::string& key : Differences(running_.given, command->given)) {
    (IsLiveSetting(key) ? outcome.changed : outcome.waiting).push_back(key);
    if (IsLiveSetting(key)) {
      TakeOver(key, command->given, merged);
    }
  }
  const Result<DaemonConfig> config = ConfigFrom(merged);
  if (!config) {
    return Error(config.error());
  }
  const Result<std::vector<Commit>> commits = PrepareParts(*config);
  if (!commits) {
    return Error(commits.error());
  }
  for (const Commit& commit : *commits) {
    commit();
  }
  running_.config = *config;
  running_.given = std::move(merged);
  return outcome;
}

Result<std::vector<LiveConfig::Commit>> LiveConfig::PrepareParts(const DaemonConfig& config) const {
  std::vector<Commit> commits;
  for (const Prepare& prepare : parts_) {
    Result<Commit> commit = prepare(config);
    if (!commit) {
      return Error(commit.error());
    }
    commits.push_back(*std::move(commit));
  }
  return commits;
}

}  // namespace atlas
