// One atlas and its vehicles, whose daemon is killed again and again.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "client/connection/atlas_client.h"
#include "tests/client/end_to_end/daemon_process.h"
#include "tests/client/ledger/fleet.h"
#include "tests/client/ledger/ledger_judge.h"
#include "tests/client/ledger/stored_atlas.h"

namespace atlas::testing {

struct CrashFigures {
  std::uint64_t kills = 0;
  std::uint64_t kills_in_flight = 0;  // some vehicle waited for an answer
  std::uint64_t requests_cut = 0;     // all of these
  std::uint64_t kills_in_start = 0;   // before it listened
  std::uint64_t starts_dirty = 0;     // the daemon before left tiles to fuse
  std::uint64_t vehicle_kills = 0;
  std::uint64_t checks = 0;
  std::uint64_t digest_mismatches = 0;  // of a clean atlas, or of a tile fused again from nothing
  std::uint64_t keyframes = 0;          // acknowledged, or taken by a spool
  std::uint64_t pose_batches = 0;       // acknowledged, as are the next
  std::uint64_t session_changes = 0;
  std::uint64_t releases = 0;  // sessions that were let out of quarantine
  std::uint64_t purges = 0;
  std::uint64_t unanswered = 0;     // keyframes and pose batches: may be there
  std::vector<double> restarts_ms;  // exec until the first request is answered
  Verdict verdict;

  void Count(const LedgerState& ledger);
};

class CrashLife {
 public:
  CrashLife(const std::filesystem::path& folder, std::uint32_t seed, CrashFigures& figures);

  // Ends with a check after the spools were emptied. Throws where the daemon does not come back,
  // and where a vehicle was answered wrongly.
  void Run(std::uint32_t kills, std::uint32_t kills_between_checks);

 private:
  using Clock = std::chrono::steady_clock;

  DaemonProcess Begin();
  AtlasClient Await(DaemonProcess& daemon) const;
  void KillOnce();
  // The vehicle that was killed meanwhile, or -1.
  int LetWork(DaemonProcess& daemon);
  void NoteCut(int killed_vehicle);
  void Check(bool is_last);
  Bytes DigestAfter(DaemonProcess& daemon, bool is_last);
  void SendSpools(AtlasClient& client);
  void Judge(StoredAtlas stored, bool is_last);
  std::uint32_t Between(std::uint32_t low, std::uint32_t high);

  std::filesystem::path folder_;
  CrashFigures& figures_;
  std::mt19937 random_;
  std::uint16_t port_;
  Fleet fleet_;
  StoredAtlas stored_;       // at the check before
  Clock::time_point begun_;  // the daemon's exec
  double last_restart_ms_ = 30.0;
};

}  // namespace atlas::testing
