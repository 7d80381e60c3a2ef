// Fills a daemon's atlas with copies of a recorded drive, and reads it all over: what a daemon
// needs to serve atlases of different sizes. JSON lines. Usage: memory_bench fill SERVER DRIVE MIB
// NTH    until the database has so many MiB, of every
//                                                  NTH keyframe; a line every 32 copies
//        memory_bench read SERVER DRIVE COPIES SECONDS    places all over so many copies
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>

#include "tests/bench/memory/drive_copies.h"
#include "tests/bench/memory/map_readers.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kCopiesAtOnce = 8;  // are fused before the next ones come
constexpr std::uint32_t kCopiesPerLine = 32;
constexpr std::chrono::hours kPatience(1);

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void PrintFill(std::uint32_t copies, const AtlasStatus& status, Clock::time_point start) {
  std::cout << "{\"copies\": " << copies << ", \"keyframes\": " << status.keyframes
            << ", \"tiles\": " << status.tiles << ", \"keyframe_bytes\": " << status.keyframe_bytes
            << ", \"tile_bytes\": " << status.tile_bytes
            << ", \"store_bytes\": " << status.store_bytes
            << ", \"seconds\": " << SecondsSince(start) << "}" << std::endl;
}

Result<AtlasClient> Connect(const Endpoint& endpoint) {
  ConnectionOptions options;
  options.endpoint = endpoint;
  return AtlasClient::Connect(options);
}

Status Fill(const Endpoint& endpoint, const std::string& folder, std::uint64_t bytes, int nth) {
  auto client = Connect(endpoint);
  if (!client) return client.error();
  const auto drive = DriveCopies::Read(folder, client->profile(), static_cast<std::size_t>(nth));
  if (!drive) return drive.error();
  const Clock::time_point start = Clock::now();
  for (std::uint32_t copies = 0;;) {
    for (std::uint32_t i = 0; i < kCopiesAtOnce; ++i) {
      ATLAS_RETURN_IF_ERROR(drive->Upload(*client, copies++));
    }
    const auto waited = client->WaitUntilFused(kPatience);
    if (!waited) return waited.error();
    const auto status = client->ReadStatus();
    if (!status) return status.error();
    const bool is_full = status->store_bytes >= bytes;
    if (is_full || copies % kCopiesPerLine == 0) PrintFill(copies, *status, start);
    if (is_full) return {};
  }
}

Status Read(const Endpoint& endpoint, const std::string& folder, int copies, int seconds) {
  auto client = Connect(endpoint);
  if (!client) return client.error();
  const auto drive = DriveCopies::Read(folder, client->profile(), 1);
  if (!drive) return drive.error();
  ReadersOptions options;
  options.endpoint = endpoint;
  options.time = std::chrono::seconds(seconds);
  for (int i = 0; i < copies; ++i) {
    options.places_m.push_back(drive->MiddleOf(static_cast<std::uint32_t>(i)));
  }
  const auto report = ReadMaps(options);
  if (!report) return report.error();
  std::cout << "{\"syncs\": " << report->syncs << ", \"queries\": " << report->queries
            << ", \"tiles\": " << report->tiles << ", \"bytes\": " << report->bytes << "}"
            << std::endl;
  return {};
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  const std::string what = argc == 6 ? argv[1] : "";
  const auto endpoint = atlas::Endpoint::Parse(argc == 6 ? argv[2] : "");
  const int first = argc == 6 ? std::atoi(argv[4]) : 0;
  const int second = argc == 6 ? std::atoi(argv[5]) : 0;
  if ((what != "fill" && what != "read") || !endpoint || first < 1 || second < 1) {
    std::cerr
        << "usage: memory_bench fill SERVER DRIVE MIB NTH | read SERVER DRIVE COPIES SECONDS\n";
    return 2;
  }
  const atlas::Status status =
      what == "fill" ? atlas::testing::Fill(*endpoint, argv[3], std::uint64_t(first) << 20, second)
                     : atlas::testing::Read(*endpoint, argv[3], first, second);
  if (!status.ok()) {
    std::cerr << "memory_bench: " << status.message() << "\n";
    return 1;
  }
  return 0;
}
