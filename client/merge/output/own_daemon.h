// A daemon in a process of its own, on an atlas that nobody else uses.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include <sys/types.h>

#include "client/connection/endpoint.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

struct OwnDaemonOptions {
  std::filesystem::path data;     // its data directory
  std::filesystem::path backups;  // the folder of its backups, which is there
  // Of a new atlas. What a daemon has no setting for stays as it is by default.
  std::optional<MapProfile> profile;
};

// On a port of loopback that it chose itself. It ends with this object, and with this process
// however that ends; a Ctrl-C for this process is none for it. What it has to say against its own
// work is on stderr.
class OwnDaemon {
 public:
  // Waits until it listens. kNotFound: there is no `atlasd` beside this program, nor on the PATH.
  // kUnavailable: it ended, and said why. kTimeout: it does neither. kResourceExhausted: there is
  // no room for a process.
  static Result<OwnDaemon> Start(const OwnDaemonOptions& options);
  OwnDaemon(OwnDaemon&&) noexcept;
  OwnDaemon& operator=(OwnDaemon&&) noexcept;
  OwnDaemon(const OwnDaemon&) = delete;
  OwnDaemon& operator=(const OwnDaemon&) = delete;
  ~OwnDaemon();

  const Endpoint& endpoint() const { return endpoint_; }
  // Ends it; kUnavailable if it did not end well.
  Status Stop();

 private:
  class Process;
  explicit OwnDaemon(std::unique_ptr<Process> process);

  std::unique_ptr<Process> process_;
  Endpoint endpoint_;
};

}  // namespace atlas
