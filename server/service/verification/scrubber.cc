#include "server/service/verification/scrubber.h"

#include <exception>
#include <utility>

#include "core/base/str_cat.h"
#include "server/base/stoppable_sleep.h"
#include "server/base/thread_priority.h"
#include "server/service/verification/atlas_verify.h"

namespace atlas {
namespace {

constexpr int kNice = 19;

}  // namespace

Scrubber::Scrubber(AtlasStore& store,
                   ChangeSignal& changes,
                   LogSink log,
                   const ScrubOptions& options)
    : store_(store), changes_(changes), log_(std::move(log)), options_(options) {
  if (options_.bytes_per_s > 0) {
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }
}

void Scrubber::Stop() {
  thread_.request_stop();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void Scrubber::Run(const std::stop_token& stop) {
  YieldToOthers(kNice);
  for (auto wait = options_.first_after; !SleepUnlessStopped(stop, wait); wait = options_.between) {
    try {
      Pass(stop);
    } catch (const std::exception& error) {
      log_(LogLevel::kError, StrCat("scrub: ", error.what()));
    }
  }
}

void Scrubber::Pass(const std::stop_token& stop) {
  const Status stopped(StatusCode::kUnavailable, "stopped");
  AtlasVerifier::Options options;
  options.check_stop = [&] {
    return stop.stop_requested() ? stopped : Status();
  };
  options.on_read = [&](std::size_t bytes) {
    ++checked_;
    SleepUnlessStopped(stop, std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                 std::chrono::duration<double>(static_cast<double>(bytes) /
                                                               options_.bytes_per_s)));
  };
  const auto report = AtlasVerifier(store_, options).Run();
  if (stop.stop_requested()) {
    return;
  }
  changes_.Notify();  // damaged tiles were marked
  if (!report) {
    log_(LogLevel::kError,
         StrCat("scrub: given up until the next time: ", report.error().message()));
    return;
  }
  ++passes_;
  damaged_ += report->damaged;
  for (const std::string& finding : report->findings) {
    log_(LogLevel::kError, "scrub: " + finding);
  }
  log_(report->damaged == 0 ? LogLevel::kInfo : LogLevel::kError,
       StrCat("scrub: ", report->checked, " keyframes and tiles read, ", report->damaged,
              " damaged"));
}

}  // namespace atlas
