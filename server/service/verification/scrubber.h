// Reads the whole atlas back again and again, at a pace that nobody notices: what is damaged on
// disk is found before somebody needs it. As a verification without a rebuild: damaged keyframes
// are listed, damaged tiles built again. Before it, and first of all after a start, it looks
// whether the indexes are what their tables are, as fast as it can: what they have else is a wrong
// answer without an error. They are made anew then, and all that was fused by them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>

#include "server/service/change_signal.h"
#include "server/service/log_sink.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct ScrubOptions {
  double bytes_per_s = 0;  // of blobs; 0: nothing is read
  std::chrono::seconds first_after{60};
  std::chrono::seconds between{24 * 3'600};  // the end of a pass and the next one
  bool checks_indexes = false;               // whatever else is read
};

// Since the start.
struct ScrubFigures {
  std::uint64_t passes = 0;   // that were ended
  std::uint64_t checked = 0;  // keyframes and tiles
  std::uint64_t damaged = 0;
};

class Scrubber {
 public:
  Scrubber(AtlasStore& store, ChangeSignal& changes, LogSink log, const ScrubOptions& options);
  ~Scrubber() { Stop(); }
  Scrubber(const Scrubber&) = delete;
  Scrubber& operator=(const Scrubber&) = delete;

  // In the middle of a pass, too.
  void Stop();
  ScrubFigures figures() const { return {passes_, checked_, damaged_}; }

 private:
  void Run(const std::stop_token& stop);
  void Try(const std::function<void()>& work) const;
  void CheckIndexes(const std::stop_token& stop);
  void RepairIndexes();
  void Pass(const std::stop_token& stop);

  AtlasStore& store_;
  ChangeSignal& changes_;
  LogSink log_;
  const ScrubOptions options_;
  std::atomic<std::uint64_t> passes_{0};
  std::atomic<std::uint64_t> checked_{0};
  std::atomic<std::uint64_t> damaged_{0};
  std::jthread thread_;
};

}  // namespace atlas
