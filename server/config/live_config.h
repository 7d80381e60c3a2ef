// The settings of a daemon that runs: read again on request, and given to the parts that can take
// others while they run. Either all of them take the new ones, or none does.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/base/status.h"
#include "server/config/daemon_command.h"
#include "server/config/named_files.h"

namespace atlas {

// For one thread.
class LiveConfig {
 public:
  using Commit = std::function<void()>;
  // A part looks at new settings, and at the files that they name; what it returns puts them into
  // effect and cannot fail. Called whether settings of its own changed or not: files may have.
  using Prepare = std::function<Result<Commit>(const DaemonConfig&)>;
  using Read = std::function<Result<DaemonCommand>()>;

  struct Outcome {
    std::vector<std::string> changed;  // keys that are in effect now
    std::vector<std::string> renewed;  // keys of files that have their old name and other content
    std::vector<std::string> waiting;  // keys that differ and need a restart
  };

  LiveConfig(DaemonCommand running, Read read)
      : running_(std::move(running)),
        read_(std::move(read)),
        file_hashes_(HashNamedFiles(running_.config)) {}

  void AddPart(Prepare part) { parts_.push_back(std::move(part)); }
  // What is in effect.
  const DaemonConfig& config() const { return running_.config; }

  // Without success everything is as it was; the error names what is wrong, and where.
  Result<Outcome> Reload();

 private:
  Result<std::vector<Commit>> PrepareParts(const DaemonConfig& config) const;

  DaemonCommand running_;
  Read read_;
  std::map<std::string, std::uint64_t> file_hashes_;  // by key, of what is in effect
  std::vector<Prepare> parts_;
};

}  // namespace atlas
