#include "tests/client/end_to_end/daemon_process.h"

#include <array>
#include <csignal>
#include <stdexcept>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace atlas {
namespace {

// The first line that the daemon prints.
std::string ReadLine(int fd) {
  std::string line;
  char c = 0;
  while (read(fd, &c, 1) == 1 && c != '\n') {
    line += c;
  }
  return line;
}

pid_t Spawn(std::vector<std::string> arguments, int stdout_fd) {
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) {
    argv.push_back(argument.data());
  }
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions{};
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, stdout_fd, STDOUT_FILENO);
  pid_t pid = -1;
  const int error = posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("cannot start " + arguments[0]);
  return pid;
}

}  // namespace

DaemonProcess::DaemonProcess(const std::filesystem::path& data,
                             const std::vector<std::string>& more_flags) {
  std::array<int, 2> pipe_fds{};
  if (pipe2(pipe_fds.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  std::vector<std::string> arguments = {ATLASD_PATH, "--data", data.string(), "--listen",
                                        "127.0.0.1:0"};
  arguments.insert(arguments.end(), more_flags.begin(), more_flags.end());
  pid_ = Spawn(std::move(arguments), pipe_fds[1]);
  close(pipe_fds[1]);
  const std::string line = ReadLine(pipe_fds[0]);
  close(pipe_fds[0]);
  const std::string prefix = "listening ";
  if (line.rfind(prefix, 0) != 0) {
    Stop(SIGKILL);
    throw std::runtime_error("the daemon printed '" + line + "'");
  }
  address_ = line.substr(prefix.size());
}

DaemonProcess::~DaemonProcess() {
  if (pid_ > 0) Stop(SIGKILL);
}

int DaemonProcess::Stop(int signal) {
  kill(pid_, signal);
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace atlas
