#include "server/config/live_config.h"

#include <algorithm>
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

// Keys of files whose content is another, but for those that have another name.
std::vector<std::string> Renewed(const std::map<std::string, std::uint64_t>& before,
                                 const std::map<std::string, std::uint64_t>& after,
                                 const std::vector<std::string>& renamed) {
  std::vector<std::string> keys;
  for (const auto& [key, hash] : after) {
    const auto old = before.find(key);
    const bool is_other = old == before.end() || old->second != hash;
    if (is_other && std::find(renamed.begin(), renamed.end(), key) == renamed.end()) {
      keys.push_back(key);
    }
  }
  return keys;
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
  // Before the parts read them: what changes in between is told the next time.
  auto hashes = HashNamedFiles(*config);
  outcome.renewed = Renewed(file_hashes_, hashes, outcome.changed);
  const Result<std::vector<Commit>> commits = PrepareParts(*config);
  if (!commits) {
    return Error(commits.error());
  }
  for (const Commit& commit : *commits) {
    commit();
  }
  running_.config = *config;
  running_.given = std::move(merged);
  file_hashes_ = std::move(hashes);
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
