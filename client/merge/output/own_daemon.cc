#include "client/merge/output/own_daemon.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <linux/close_range.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kStartTimeout{120};

// Beside this program, else on the PATH.
Result<std::string> FindDaemon() {
  constexpr const char* kName = "atlasd";
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  std::vector<fs::path> folders;
  if (!error) folders.push_back(self.parent_path());
  const char* const path = std::getenv("PATH");
  std::string rest = path == nullptr ? "" : path;
  while (!rest.empty()) {
    const std::size_t end = rest.find(':');
    folders.emplace_back(rest.substr(0, end));
    rest = end == std::string::npos ? "" : rest.substr(end + 1);
  }
  for (const fs::path& folder : folders) {
    const std::string program = (folder / kName).string();
    if (::access(program.c_str(), X_OK) == 0) return program;
  }
  return Error(StatusCode::kNotFound,
               "there is no atlasd beside this program, nor on the PATH: it makes the new atlas");
}

std::string Metres(double metres) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6f", metres);
  return text.data();
}

std::vector<std::string> ArgumentsOf(const OwnDaemonOptions& options, const std::string& program) {
  std::vector<std::string> arguments{program,
                                     "--data",
                                     options.data.string(),
                                     "--listen",
                                     "127.0.0.1:0",
                                     "--backup-folder",
                                     options.backups.string(),
                                     "--backup-mib-per-s",
                                     "0",
                                     "--scrub-kib-per-s",
                                     "0",
                                     "--sessions-per-hour-per-vehicle",
                                     "0",
                                     "--fusion-nice",
                                     "0",
                                     "--log-level",
                                     "error"};
  if (options.profile) {
    const MapProfile& profile = *options.profile;
    arguments.insert(arguments.end(), {"--cell-size", Metres(profile.cell_size_m()), "--segments",
                                       StrCat(int{profile.column_segments}), "--segment-height",
                                       Metres(1e-3 * profile.segment_height_mm), "--preset",
                                       std::string(FusionPresetName(profile.preset))});
  }
  return arguments;
}

// In the child, where nothing may be called that another thread had begun.
[[noreturn]] void Become(const std::vector<char*>& argv, int out_fd, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(1);
  const int nothing = ::open("/dev/null", O_RDONLY);
  if (nothing < 0 || ::dup2(nothing, STDIN_FILENO) < 0 || ::dup2(out_fd, STDOUT_FILENO) < 0) {
    ::_exit(1);
  }
  ::close_range(STDERR_FILENO + 1, ~0U, CLOSE_RANGE_CLOEXEC);
  for (const int signal : {SIGINT, SIGTERM, SIGPIPE}) std::signal(signal, SIG_DFL);
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

}  // namespace

class OwnDaemon::Process {
 public:
  Process(pid_t pid, int out_fd) : pid_(pid), out_fd_(out_fd) {}
  ~Process() {
    static_cast<void>(Stop());
    ::close(out_fd_);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  Process(Process&&) = delete;
  Process& operator=(Process&&) = delete;

  // The next line that it prints.
  Result<std::string> ReadLine() const {
    const auto deadline = Clock::now() + kStartTimeout;
    std::string line;
    while (line.empty() || line.back() != '\n') {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
      pollfd waiting{out_fd_, POLLIN, 0};
      const int ready = left.count() <= 0 ? 0 : ::poll(&waiting, 1, static_cast<int>(left.count()));
      if (ready < 0 && errno == EINTR) continue;
      if (ready <= 0) return Error(StatusCode::kTimeout, "atlasd does not begin to listen");
      char c = 0;
      const ssize_t size = ::read(out_fd_, &c, 1);
      if (size < 0 && errno == EINTR) continue;
      if (size <= 0) return Error(StatusCode::kUnavailable, "atlasd ended before it listened");
      line += c;
    }
    line.pop_back();
    return line;
  }

  Status Stop() {
    if (pid_ <= 0) return {};
    ::kill(pid_, SIGTERM);
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return WIFEXITED(status) && WEXITSTATUS(status) == 0
               ? Status()
               : Status(StatusCode::kUnavailable, "atlasd did not end well");
  }

 private:
  pid_t pid_;
  int out_fd_;
};

OwnDaemon::OwnDaemon(std::unique_ptr<Process> process) : process_(std::move(process)) {}
OwnDaemon::OwnDaemon(OwnDaemon&&) noexcept = default;
OwnDaemon& OwnDaemon::operator=(OwnDaemon&&) noexcept = default;
OwnDaemon::~OwnDaemon() = default;

Result<OwnDaemon> OwnDaemon::Start(const OwnDaemonOptions& options) {
  const Result<std::string> program = FindDaemon();
  if (!program) return Error(program.error());
  std::vector<std::string> arguments = ArgumentsOf(options, *program);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::array<int, 2> out{};
  if (::pipe2(out.data(), O_CLOEXEC) != 0) {
    return Error(DiskError("cannot start", *program, errno));
  }
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) Become(argv, out[1], parent);
  const int error = errno;
  ::close(out[1]);
  if (pid < 0) {
    ::close(out[0]);
    return Error(DiskError("cannot start", *program, error));
  }
  OwnDaemon daemon(std::make_unique<Process>(pid, out[0]));
  const Result<std::string> line = daemon.process_->ReadLine();
  if (!line) return Error(line.error());
  constexpr std::string_view kListening = "listening ";
  if (line->rfind(kListening, 0) != 0) {
    return Error(StatusCode::kUnavailable, StrCat(*program, " says '", *line, "'"));
  }
  Result<Endpoint> endpoint = Endpoint::Parse(line->substr(kListening.size()));
  if (!endpoint) return Error(endpoint.error());
  daemon.endpoint_ = *std::move(endpoint);
  return daemon;
}

Status OwnDaemon::Stop() {
  return process_->Stop();
}

}  // namespace atlas
