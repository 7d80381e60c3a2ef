#include "tests/client/end_to_end/daemon_process.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <stdexcept>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace atlas {
namespace {

constexpr int kPatience_ms = 30'000;

struct Pipe {
  int read_fd = -1;
  int write_fd = -1;
};

Pipe MakePipe() {
  std::array<int, 2> fds{};
  if (pipe2(fds.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  return {fds[0], fds[1]};
}

// The next line that the daemon prints; what there is of it when it ends.
std::string ReadLine(int fd) {
  std::string line;
  char c = 0;
  while (read(fd, &c, 1) == 1 && c != '\n') {
    line += c;
  }
  return line;
}

// What comes behind `prefix`; empty: the line is another.
std::string Rest(const std::string& line, const std::string& prefix) {
  return line.rfind(prefix, 0) == 0 ? line.substr(prefix.size()) : "";
}

// A `log_fd` of -1 leaves the test's.
pid_t Spawn(std::vector<std::string> arguments, int stdout_fd, int log_fd) {
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) {
    argv.push_back(argument.data());
  }
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions{};
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, stdout_fd, STDOUT_FILENO);
  if (log_fd >= 0) posix_spawn_file_actions_adddup2(&actions, log_fd, STDERR_FILENO);
  pid_t pid = -1;
  const int error = posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("cannot start " + arguments[0]);
  return pid;
}

}  // namespace

DaemonProcess::DaemonProcess(const std::filesystem::path& data,
                             const std::string& listen,
                             const std::vector<std::string>& more_flags,
                             Log log)
    : has_http_(std::find(more_flags.begin(), more_flags.end(), "--http") != more_flags.end()) {
  const Pipe out = MakePipe();
  const Pipe err = log == Log::kKept ? MakePipe() : Pipe();
  std::vector<std::string> arguments = {ATLASD_PATH, "--data", data.string(), "--listen", listen};
  arguments.insert(arguments.end(), more_flags.begin(), more_flags.end());
  pid_ = Spawn(std::move(arguments), out.write_fd, err.write_fd);
  close(out.write_fd);
  if (err.write_fd >= 0) close(err.write_fd);
  out_fd_ = out.read_fd;
  log_fd_ = err.read_fd;
}

DaemonProcess::DaemonProcess(const std::filesystem::path& data,
                             const std::vector<std::string>& more_flags,
                             Log log)
    : DaemonProcess(data, "127.0.0.1:0", more_flags, log) {
  const std::string printed = AwaitListening();
  if (address_.empty()) throw std::runtime_error("the daemon printed '" + printed + "'");
}

DaemonProcess DaemonProcess::Begin(const std::filesystem::path& data,
                                   const std::string& listen,
                                   const std::vector<std::string>& more_flags) {
  return {data, listen, more_flags, Log::kOfTheTest};
}

DaemonProcess::~DaemonProcess() {
  if (pid_ > 0) Stop(SIGKILL);
  close(out_fd_);
  if (log_fd_ >= 0) close(log_fd_);
}

std::string DaemonProcess::AwaitListening() {
  std::string line = ReadLine(out_fd_);
  address_ = Rest(line, "listening ");
  if (has_http_) http_address_ = Rest(ReadLine(out_fd_), "http ");
  return line;
}

std::uint16_t DaemonProcess::PortOf(const std::string& address) {
  return static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
}

void DaemonProcess::Signal(int signal) const {
  // kill(-1, ...) is everybody.
  if (pid_ <= 0) throw std::logic_error("a signal to a daemon that was stopped");
  kill(pid_, signal);
}

void DaemonProcess::LimitFiles(std::uint64_t bytes) const {
  if (pid_ <= 0) throw std::logic_error("a limit for a daemon that was stopped");
  rlimit limit{};
  bool is_set = prlimit(pid_, RLIMIT_FSIZE, nullptr, &limit) == 0;
  limit.rlim_cur = bytes;
  is_set = is_set && prlimit(pid_, RLIMIT_FSIZE, &limit, nullptr) == 0;
  if (!is_set) throw std::runtime_error("the limit of files is refused");
}

std::string DaemonProcess::ReadLogUntil(const std::string& words) {
  pollfd waiting{log_fd_, POLLIN, 0};
  while (poll(&waiting, 1, kPatience_ms) == 1) {
    std::string line = ReadLine(log_fd_);
    if (line.empty() || line.find(words) != std::string::npos) return line;
  }
  return "";
}

int DaemonProcess::Stop(int signal) {
  Signal(signal);
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace atlas
