// How long small requests wait for their answers, whatever goes on beside: one JSON line.
// Usage: answer_bench PORT status SECONDS
//        answer_bench PORT uploads SECONDS SESSION
//        answer_bench PORT past SIDE TOKEN OTHER_TOKEN DIGESTS
// The atlas is that of wide_atlas.
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "tests/bench/serving/past_answers.h"
#include "tests/bench/serving/prompt_answers.h"
#include "tests/bench/updates/quantile.h"

namespace atlas::testing {
namespace {

using Arguments = std::vector<std::string>;

std::chrono::milliseconds SecondsOf(const std::string& text) {
  return std::chrono::milliseconds(static_cast<int>(1e3 * std::atof(text.c_str())));
}

Result<AnswerFigures> AllInTime(Result<std::vector<double>> waits_ms) {
  if (!waits_ms) {
    return Error(waits_ms.error());
  }
  return AnswerFigures{*waits_ms, static_cast<int>(waits_ms->size())};
}

Result<AnswerFigures> Run(const Arguments& args) {
  const std::string way = args.size() > 2 ? args[1] : "";
  const auto port = static_cast<std::uint16_t>(args.empty() ? 0 : std::atoi(args[0].c_str()));
  if (way == "status" && args.size() == 3) {
    return AllInTime(TimeStatus(port, SecondsOf(args[2])));
  }
  if (way == "uploads" && args.size() == 4) {
    return AllInTime(TimeUploads(port, SecondsOf(args[2]), args[3]));
  }
  if (way == "past" && args.size() == 6) {
    return TimePast(port, std::atoi(args[2].c_str()), args[3], args[4], std::atoi(args[5].c_str()));
  }
  return Error(StatusCode::kInvalidArgument,
               "usage: answer_bench PORT status SECONDS | uploads SECONDS SESSION | past SIDE "
               "TOKEN OTHER_TOKEN DIGESTS");
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  const auto figures = atlas::testing::Run({argv + 1, argv + argc});
  if (!figures) {
    std::cerr << "answer_bench: " << figures.error().message() << "\n";
    return 1;
  }
  std::cout << "{\"asked\": " << figures->waits_ms.size() << ", \"in_time\": " << figures->in_time
            << ", \"ms_p50\": " << atlas::testing::Quantile(figures->waits_ms, 0.5)
            << ", \"ms_p99\": " << atlas::testing::Quantile(figures->waits_ms, 0.99)
            << ", \"ms_max\": " << atlas::testing::Quantile(figures->waits_ms, 1.0) << "}"
            << std::endl;
  return 0;
}
