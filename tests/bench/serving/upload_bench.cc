// Keyframes that were made before into a daemon, or plainly into a file: one JSON line.
// Usage: upload_bench send DATABASE PORT SESSION VEHICLES KEYFRAMES PER_S [age]
//        upload_bench raw DATABASE FILE KEYFRAMES
// DATABASE is an atlas whose daemon has ended: its keyframes are sent. KEYFRAMES and PER_S are of
// each vehicle; PER_S 0: as fast as the daemon takes them. `send` says first that it is ready.
// age: how old the map was meanwhile is measured as well.
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "tests/bench/serving/map_age.h"
#include "tests/bench/serving/raw_writer.h"
#include "tests/bench/serving/stored_uploads.h"
#include "tests/bench/serving/upload_fleet.h"
#include "tests/bench/updates/quantile.h"

namespace atlas::testing {
namespace {

using Arguments = std::vector<std::string>;

std::size_t CountOf(const std::string& text) {
  return static_cast<std::size_t>(std::strtoull(text.c_str(), nullptr, 10));
}

Result<UploadFigures> Send(const Arguments& args) {
  const auto uploads = ReadStoredUploads(args[1]);
  if (!uploads) {
    return Error(uploads.error());
  }
  FleetOptions options;
  options.port = static_cast<std::uint16_t>(CountOf(args[2]));
  options.session = args[3];
  options.vehicles = CountOf(args[4]);
  options.keyframes = CountOf(args[5]);
  options.per_s = std::atof(args[6].c_str());
  const bool with_age = args.size() > 7;
  Result<MapAge> age = Error(StatusCode::kNotFound, "not asked for");
  if (with_age) {
    age = MapAge::Start(options.port);
    if (!age) {
      return Error(age.error());
    }
  }
  auto figures = RunFleet(*uploads, options, [] { std::cout << "{\"ready\": true}" << std::endl; });
  if (with_age && figures) {
    auto ages = age->Stop();
    if (!ages) {
      return Error(ages.error());
    }
    figures->map_age_s = *std::move(ages);
  }
  return figures;
}

Result<UploadFigures> Raw(const Arguments& args) {
  const auto uploads = ReadStoredUploads(args[1]);
  if (!uploads) {
    return Error(uploads.error());
  }
  return WriteRaw(*uploads, CountOf(args[3]), args[2]);
}

void Print(const UploadFigures& figures) {
  std::cout << "{\"keyframes\": " << figures.keyframes << ", \"bytes\": " << figures.bytes
            << ", \"seconds\": " << figures.seconds
            << ", \"acknowledged_ms_p50\": " << Quantile(figures.acknowledged_ms, 0.5)
            << ", \"acknowledged_ms_p99\": " << Quantile(figures.acknowledged_ms, 0.99)
            << ", \"map_age_s_p50\": " << Quantile(figures.map_age_s, 0.5)
            << ", \"map_age_s_max\": " << Quantile(figures.map_age_s, 1.0) << "}" << std::endl;
}

int Main(int argc, char** argv) {
  const Arguments args(argv + 1, argv + argc);
  Result<UploadFigures> figures =
      Error(StatusCode::kInvalidArgument,
            "usage: upload_bench send DATABASE PORT SESSION VEHICLES KEYFRAMES PER_S [age] | raw "
            "DATABASE FILE KEYFRAMES");
  const bool with_age = args.size() == 8 && args[7] == "age";
  if ((args.size() == 7 || with_age) && args[0] == "send") {
    figures = Send(args);
  } else if (args.size() == 4 && args[0] == "raw") {
    figures = Raw(args);
  }
  if (!figures) {
    std::cerr << "upload_bench: " << figures.error().message() << "\n";
    return 1;
  }
  Print(*figures);
  return 0;
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  return atlas::testing::Main(argc, argv);
}
