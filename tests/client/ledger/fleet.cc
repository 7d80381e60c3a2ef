#include "tests/client/ledger/fleet.h"

#include <array>
#include <csignal>
#include <stdexcept>
#include <string>
#include <utility>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/str_cat.h"

namespace atlas::testing {
namespace {

constexpr std::array<VehicleKind, Fleet::kVehicles> kKinds = {
    VehicleKind::kDirect, VehicleKind::kDirect, VehicleKind::kDirect, VehicleKind::kResume,
    VehicleKind::kResume, VehicleKind::kSpool,  VehicleKind::kSpool,  VehicleKind::kSpool,
    VehicleKind::kLeap,   VehicleKind::kPurge};
static_assert(kKinds[kLeapingVehicle] == VehicleKind::kLeap);

std::string NameOf(VehicleKind kind) {
  switch (kind) {
    case VehicleKind::kDirect:
      return "direct";
    case VehicleKind::kResume:
      return "resume";
    case VehicleKind::kSpool:
      return "spool";
    case VehicleKind::kLeap:
      return "leap";
    case VehicleKind::kPurge:
      return "purge";
  }
  return "";
}

pid_t Spawn(std::vector<std::string> arguments) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) {
    argv.push_back(argument.data());
  }
  argv.push_back(nullptr);
  pid_t pid = -1;
  if (posix_spawn(&pid, argv[0], nullptr, nullptr, argv.data(), environ) != 0) {
    throw std::runtime_error("cannot start " + arguments[0]);
  }
  return pid;
}

}  // namespace

Fleet::Fleet(std::filesystem::path folder, std::uint16_t port, std::uint32_t seed)
    : folder_(std::move(folder)), port_(port), seed_(seed), pids_(kVehicles, -1) {
  std::filesystem::create_directories(folder_);
  for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
    readers_.emplace_back(LedgerOf(vehicle));
  }
}

Fleet::~Fleet() {
  KillAll();
}

void Fleet::Start() {
  for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
    pid_t& pid = pids_.at(static_cast<std::size_t>(vehicle));
    if (pid > 0) continue;
    pid = Spawn({LEDGER_CLIENT_PATH, LedgerOf(vehicle).string(), SpoolOf(vehicle).string(),
                 NameOf(KindOf(vehicle)), std::to_string(vehicle), std::to_string(port_),
                 std::to_string(seed_++)});
  }
}

void Fleet::Kill(int vehicle) {
  pid_t& pid = pids_.at(static_cast<std::size_t>(vehicle));
  if (pid <= 0) return;
  kill(pid, SIGKILL);
  waitpid(pid, nullptr, 0);
  pid = -1;
}

void Fleet::KillAll() {
  for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
    Kill(vehicle);
  }
}

void Fleet::ExpectAlive() {
  for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
    pid_t& pid = pids_.at(static_cast<std::size_t>(vehicle));
    if (pid <= 0 || waitpid(pid, nullptr, WNOHANG) == 0) continue;
    pid = -1;
    throw std::runtime_error(StrCat("car", vehicle, " ended: ", Read(vehicle).wrong));
  }
}

VehicleKind Fleet::KindOf(int vehicle) {
  return kKinds.at(static_cast<std::size_t>(vehicle));
}

std::filesystem::path Fleet::SpoolOf(int vehicle) const {
  return folder_ / StrCat("spool", vehicle);
}

std::filesystem::path Fleet::LedgerOf(int vehicle) const {
  return folder_ / StrCat("ledger", vehicle);
}

}  // namespace atlas::testing
