#include "tests/client/ledger/crash_life.h"

#include <csignal>
#include <stdexcept>
#include <thread>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "client/vehicle/upload_spool.h"
#include "core/base/str_cat.h"
#include "tests/client/ledger/clean_atlas.h"

namespace atlas::testing {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr int kNone = -1;
constexpr std::chrono::seconds kPatience{120};
constexpr std::uint32_t kLeastUp_ms = 50;
constexpr std::uint32_t kMostUp_ms = 400;
constexpr std::uint32_t kStartsOfOneKilled = 5;
constexpr std::uint32_t kKillsOfOneVehicle = 3;

std::vector<std::string> Flags() {
  return {"--cell-size", "0.2", "--workers", "2", "--log-level", "error"};
}

bool IsFree(std::uint16_t port) {
  const int probe = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool is_free = bind(probe, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  close(probe);
  return is_free;
}

// Below those that the system gives to whoever connects: while the daemon is down one of these
// could get it, and be connected to itself.
std::uint16_t PortOfItsOwn() {
  constexpr int kFirst = 20'000;
  constexpr int kCount = 12'000;
  for (int tried = 0; tried < kCount; ++tried) {
    const auto port = static_cast<std::uint16_t>(kFirst + (getpid() * 37 + tried) % kCount);
    if (IsFree(port)) return port;
  }
  throw std::runtime_error("no port is free");
}

template <typename T>
T ValueOf(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message());
  return *std::move(result);
}

}  // namespace

CrashLife::CrashLife(const std::filesystem::path& folder, std::uint32_t seed, CrashFigures& figures)
    : folder_(folder),
      figures_(figures),
      random_(seed),
      port_(PortOfItsOwn()),
      fleet_(folder / "fleet", port_, seed) {}

std::uint32_t CrashLife::Between(std::uint32_t low, std::uint32_t high) {
  return low + static_cast<std::uint32_t>(random_() % (high - low + 1));
}

void CrashLife::Run(std::uint32_t kills, std::uint32_t kills_between_checks) {
  for (std::uint32_t kill = 1; kill <= kills; ++kill) {
    fleet_.Start();
    KillOnce();
    if (kill % kills_between_checks == 0 && kill < kills) Check(false);
  }
  Check(true);
}

DaemonProcess CrashLife::Begin() {
  begun_ = Clock::now();
  return DaemonProcess::Begin(folder_ / "data", StrCat("127.0.0.1:", port_), Flags());
}

AtlasClient CrashLife::Await(DaemonProcess& daemon) const {
  const std::string line = daemon.AwaitListening();
  if (daemon.address().empty()) throw std::runtime_error("the daemon printed '" + line + "'");
  ConnectionOptions options;
  options.endpoint = {"127.0.0.1", port_};
  return ValueOf(AtlasClient::Connect(options));
}

void CrashLife::KillOnce() {
  DaemonProcess daemon = Begin();
  for (int vehicle = 0; vehicle < Fleet::kVehicles; ++vehicle) {
    fleet_.Read(vehicle).in_flight_at_loss = 0;
  }
  int killed_vehicle = kNone;
  if (Between(1, kStartsOfOneKilled) == 1) {
    const auto most_us = static_cast<std::uint32_t>(1e3 * last_restart_ms_);
    std::this_thread::sleep_for(microseconds(Between(0, most_us)));
  } else {
    killed_vehicle = LetWork(daemon);
  }
  daemon.Stop(SIGKILL);
  ++figures_.kills;
  if (daemon.address().empty()) {
    daemon.AwaitListening();  // what it had printed by then
    figures_.kills_in_start += daemon.address().empty() ? 1U : 0U;
  }
  NoteCut(killed_vehicle);
  fleet_.ExpectAlive();
}

int CrashLife::LetWork(DaemonProcess& daemon) {
  const AtlasStatus first = ValueOf(Await(daemon).ReadStatus());
  last_restart_ms_ = std::chrono::duration<double, std::milli>(Clock::now() - begun_).count();
  figures_.restarts_ms.push_back(last_restart_ms_);
  figures_.starts_dirty += first.dirty_tiles > 0 ? 1U : 0U;
  const std::uint32_t up_ms = Between(kLeastUp_ms, kMostUp_ms);
  const std::uint32_t whole_ms = Between(0, up_ms);
  std::this_thread::sleep_for(milliseconds(whole_ms));
  int killed = kNone;
  if (Between(1, kKillsOfOneVehicle) == 1) {
    fleet_.Kill(killed = static_cast<int>(Between(0, Fleet::kVehicles - 1)));
    ++figures_.vehicle_kills;
  }
  std::this_thread::sleep_for(milliseconds(up_ms - whole_ms));
  return killed;
}

// Once every vehicle has noticed.
void CrashLife::NoteCut(int killed_vehicle) {
  std::uint64_t cut = 0;
  for (int vehicle = 0; vehicle < Fleet::kVehicles; ++vehicle) {
    if (vehicle == killed_vehicle) continue;
    const Clock::time_point latest = Clock::now() + milliseconds(200);
    while (fleet_.Read(vehicle).in_flight > 0 && Clock::now() < latest) {
      std::this_thread::sleep_for(milliseconds(1));
    }
    cut += fleet_.Read(vehicle).in_flight_at_loss;
  }
  figures_.requests_cut += cut;
  figures_.kills_in_flight += cut > 0 ? 1U : 0U;
}

void CrashLife::Check(bool is_last) {
  fleet_.KillAll();
  DaemonProcess daemon = Begin();
  const Bytes digest = DigestAfter(daemon, is_last);
  daemon.Stop(SIGKILL);
  Judge(ReadStoredAtlas(folder_ / "data"), is_last);
  const std::filesystem::path clean = folder_ / "clean";
  figures_.digest_mismatches += digest == CleanDigest(stored_, clean, Flags()) ? 0U : 1U;
  std::filesystem::remove_all(clean);
  ++figures_.checks;
}

// At the end every tile is also fused again from nothing.
Bytes CrashLife::DigestAfter(DaemonProcess& daemon, bool is_last) {
  AtlasClient client = Await(daemon);
  if (is_last) SendSpools(client);
  Bytes digest = ValueOf(client.Digest(kPatience)).sha256;
  if (is_last) {
    const VerifySummary verified = ValueOf(client.Verify(true, kPatience));
    figures_.digest_mismatches += verified.damaged + verified.mismatched;
  }
  return digest;
}

void CrashLife::SendSpools(AtlasClient& client) {
  for (int vehicle = 0; vehicle < Fleet::kVehicles; ++vehicle) {
    if (Fleet::KindOf(vehicle) != VehicleKind::kSpool) continue;
    UploadSpool spool = ValueOf(UploadSpool::Open({.folder = fleet_.SpoolOf(vehicle)}));
    ValueOf(spool.Send(client, {.deadline = kPatience}));
    if (spool.waiting() > 0) throw std::runtime_error("a spool does not empty");
  }
}

void CrashLife::Judge(StoredAtlas stored, bool is_last) {
  LedgerJudge judge(stored);
  for (int vehicle = 0; vehicle < Fleet::kVehicles; ++vehicle) {
    const LedgerState& ledger = fleet_.Read(vehicle);
    judge.Judge(vehicle, ledger, ReadSpool(fleet_.SpoolOf(vehicle)));
    if (is_last) figures_.Count(ledger);
  }
  judge.JudgeAgainst(stored_);
  figures_.verdict.Add(judge.Finish());
  stored_ = std::move(stored);
}

void CrashFigures::Count(const LedgerState& ledger) {
  for (const auto& [id, frame] : ledger.frames) {
    ++(frame.is_acknowledged || frame.is_taken ? keyframes : unanswered);
  }
  for (const auto& [version, batch] : ledger.batches) {
    ++(batch.is_acknowledged ? pose_batches : unanswered);
  }
  session_changes += ledger.session_changes;
  for (const auto& [number, session] : ledger.sessions) {
    releases += session.done == SessionAction::kRelease ? 1U : 0U;
    purges += session.done == SessionAction::kPurge ? 1U : 0U;
  }
}

}  // namespace atlas::testing
