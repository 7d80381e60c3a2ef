#include "server/service/verification/scrubber.h"

#include <exception>
#include <utility>

#include "core/base/str_cat.h"
#include "server/base/stoppable_sleep.h"
#include "server/base/thread_priority.h"
#include "server/service/verification/atlas_verify.h"
#include "server/store/await.h"

namespace atlas {
namespace {

constexpr int kNice = 19;

}  // namespace

Scrubber::Scrubber(AtlasStore& store,
                   ChangeSignal& changes,
                   LogSink log,
                   const ScrubOptions& options)
    : store_(store), changes_(changes), log_(std::move(log)), options_(options) {
  if (options_.bytes_per_s > 0 || options_.checks_indexes) {
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
  Try([&] { CheckIndexes(stop); });
  if (options_.bytes_per_s <= 0) {
    return;
  }
  for (auto wait = options_.first_after; !SleepUnlessStopped(stop, wait); wait = options_.between) {
    Try([&] {
      if (passes_ > 0) {
        CheckIndexes(stop);
      }
      Pass(stop);
    });
  }
}

void Scrubber::Try(const std::function<void()>& work) const {
  try {
    work();
  } catch (const std::exception& error) {
    log_(LogLevel::kError, StrCat("scrub: ", error.what()));
  }
}

void Scrubber::CheckIndexes(const std::stop_token& stop) {
  if (!options_.checks_indexes) {
    return;
  }
  const auto begin = std::chrono::steady_clock::now();
  const Status status = store_.CheckIndexes([&stop] {
    return stop.stop_requested() ? Status(StatusCode::kUnavailable, "stopped") : Status();
  });
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  if (stop.stop_requested()) {
    return;
  }
  if (status.ok()) {
    log_(LogLevel::kDebug, StrCat("scrub: indexes are whole, looked at in ",
                                  static_cast<std::int64_t>(took.count() * 1'000), " ms"));
  } else if (status.code() == StatusCode::kInvalidData) {
    ++damaged_;
    log_(LogLevel::kError, "scrub: " + status.message());
    RepairIndexes();
  } else {
    log_(LogLevel::kError, "scrub: indexes were not looked at: " + status.message());
  }
}

// What was read or written by them before is not known: tiles are fused again; of keyframes a pass
// finds what is not as it should be.
void Scrubber::RepairIndexes() {
  const auto repaired = Await<std::uint32_t>([this](auto done) {
    store_.RepairTables(TableRepair::kIndexes, kAtlasItself, std::move(done));
  });
  changes_.Notify();
  if (repaired) {
    log_(LogLevel::kError,
         "scrub: indexes were made anew, and every tile is fused again; answers since the start "
         "may have been wrong, and for what was written since then see atlas verify --repair");
  } else {
    log_(LogLevel::kError, StrCat("scrub: indexes were not made anew (", repaired.error().message(),
                                  "): answers may be wrong until atlas verify --repair"));
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
