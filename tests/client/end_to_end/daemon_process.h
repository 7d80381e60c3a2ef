// A real daemon in a process of its own, on a port of its choice.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

namespace atlas {

class DaemonProcess {
 public:
  // Starts it on `data` and waits until it listens. Throws when it does not.
  DaemonProcess(const std::filesystem::path& data, const std::vector<std::string>& more_flags);
  ~DaemonProcess();
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;
  DaemonProcess(DaemonProcess&&) = delete;
  DaemonProcess& operator=(DaemonProcess&&) = delete;

  const std::string& address() const { return address_; }
  // Sends SIGTERM (or another signal) and waits; the exit code, or minus the signal that ended it.
  int Stop(int signal);

 private:
  pid_t pid_ = -1;
  std::string address_;  // HOST:PORT
};

}  // namespace atlas
