// The vehicles of the ledger test as processes, each with its ledger and its spool in a folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <sys/types.h>

#include "tests/client/ledger/ledger.h"
#include "tests/client/ledger/ledger_vehicle.h"

namespace atlas::testing {

class Fleet {
 public:
  static constexpr int kVehicles = 10;  // of all kinds

  Fleet(std::filesystem::path folder, std::uint16_t port, std::uint32_t seed);
  ~Fleet();
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;
  Fleet(Fleet&&) = delete;
  Fleet& operator=(Fleet&&) = delete;

  // Those that do not run. Throws where a process cannot be started.
  void Start();
  void Kill(int vehicle);
  void KillAll();
  // Throws where one ended by itself.
  void ExpectAlive();

  LedgerState& Read(int vehicle) { return readers_.at(static_cast<std::size_t>(vehicle)).Read(); }
  static VehicleKind KindOf(int vehicle);
  std::filesystem::path SpoolOf(int vehicle) const;

 private:
  std::filesystem::path LedgerOf(int vehicle) const;

  std::filesystem::path folder_;
  std::uint16_t port_;
  std::uint32_t seed_;
  std::vector<pid_t> pids_;  // -1: does not run
  std::vector<LedgerReader> readers_;
};

}  // namespace atlas::testing
