// A vehicle of the ledger test in a process of its own. Usage: LEDGER SPOOL KIND NUMBER PORT SEED,
// KIND one of direct, resume, spool, leap, purge. Ends with a wrong answer, or with the process
// that began it.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <string>

#include <sys/prctl.h>

#include "tests/client/ledger/ledger_vehicle.h"

int main(int argc, char** argv) {
  using atlas::testing::VehicleKind;
  const std::map<std::string, VehicleKind> kinds = {{"direct", VehicleKind::kDirect},
                                                    {"resume", VehicleKind::kResume},
                                                    {"spool", VehicleKind::kSpool},
                                                    {"leap", VehicleKind::kLeap},
                                                    {"purge", VehicleKind::kPurge}};
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (argc != 7 || !kinds.contains(argv[3])) {
    std::fputs("usage: LEDGER SPOOL direct|resume|spool|leap|purge NUMBER PORT SEED\n", stderr);
    return 2;
  }
  try {
    atlas::testing::LedgerVehicleOptions options;
    options.ledger = argv[1];
    options.spool = argv[2];
    options.kind = kinds.at(argv[3]);
    options.number = std::stoi(argv[4]);
    options.port = static_cast<std::uint16_t>(std::stoi(argv[5]));
    options.seed = static_cast<std::uint32_t>(std::stoul(argv[6]));
    const atlas::Status wrong = atlas::testing::LedgerVehicle(options).Run();
    std::fprintf(stderr, "ledger client %d: %s\n", options.number, wrong.message().c_str());
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "ledger client: %s\n", failure.what());
  }
  return 1;
}
