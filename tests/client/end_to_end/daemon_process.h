// A real daemon in a process of its own, on a port of its choice.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

namespace atlas {

class DaemonProcess {
 public:
  enum class Log { kOfTheTest, kKept };

  // Starts it on `data` and waits until it listens. Throws when it does not.
  DaemonProcess(const std::filesystem::path& data,
                const std::vector<std::string>& more_flags,
                Log log = Log::kOfTheTest);
  // On that HOST:PORT, and without waiting: AwaitListening does.
  static DaemonProcess Begin(const std::filesystem::path& data,
                             const std::string& listen,
                             const std::vector<std::string>& more_flags);
  ~DaemonProcess();
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;
  DaemonProcess(DaemonProcess&&) = delete;
  DaemonProcess& operator=(DaemonProcess&&) = delete;

  // The line that it prints then. Another one, and the address stays empty: it does not.
  std::string AwaitListening();

  const std::string& address() const { return address_; }
  std::uint16_t port() const { return PortOf(address_); }
  // Of the operations port; for a daemon with `--http`.
  std::uint16_t http_port() const { return PortOf(http_address_); }
  void Signal(int signal) const;
  // No file of it grows beyond so many bytes from now on (RLIMIT_FSIZE). Throws when the system
  // refuses that.
  void LimitFiles(std::uint64_t bytes) const;
  // Reads what a daemon with a kept log says, up to a line that has this in it: that line. Empty
  // when it says no such thing for half a minute.
  std::string ReadLogUntil(const std::string& words);
  // Sends SIGTERM (or another signal) and waits; the exit code, or minus the signal that ended it.
  int Stop(int signal);

 private:
  DaemonProcess(const std::filesystem::path& data,
                const std::string& listen,
                const std::vector<std::string>& more_flags,
                Log log);
  static std::uint16_t PortOf(const std::string& address);

  pid_t pid_ = -1;
  std::string address_;  // HOST:PORT, as is the next
  std::string http_address_;
  bool has_http_ = false;
  int out_fd_ = -1;
  int log_fd_ = -1;
};

}  // namespace atlas
