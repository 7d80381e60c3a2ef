// Makes room in a store that is nearly full: drops the oldest keyframes that matter nowhere any
// more, by the rules of compact_atlas.h, a stretch of time at a step, until there is enough. Off
// until it is told otherwise. On a thread of its own that stands back behind all others.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <thread>
#include <vector>

#include "server/service/compaction/compact_atlas.h"
#include "server/service/log_sink.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct AutomaticCompactionOptions {
  // Of the limit of the store, retention.store_mib. Far enough apart that it does not begin again
  // with the next upload.
  double begin_share = 0.90;
  double end_share = 0.85;
  // In a step: the writer is held up for 0.3 ms each (docs/decisions/0302).
  std::uint64_t step_keyframes = 1'024;
  std::chrono::milliseconds look_every{10'000};
  // Where not enough could go: only drives that come in later can change that.
  std::chrono::milliseconds rest{3'600'000};
};

class AutomaticCompaction {
 public:
  using Compact =
      std::function<Result<CompactionReport>(const CompactionRequest&, const std::stop_token&)>;

  AutomaticCompaction(AtlasStore& store,
                      Compact compact,
                      LogSink log,
                      const AutomaticCompactionOptions& options);
  ~AutomaticCompaction() { Stop(); }
  AutomaticCompaction(const AutomaticCompaction&) = delete;
  AutomaticCompaction& operator=(const AutomaticCompaction&) = delete;

  // From now on; a step under way goes on.
  void set_on(bool is_on) { is_on_ = is_on; }
  // In the middle of a step, too, of which nothing is left then.
  void Stop();

  // The author of what it drops, in the log of the atlas.
  static constexpr const char* kAuthor = "retention";

 private:
  enum class End { kEnough, kNothingLeft, kInterrupted };

  void Run(const std::stop_token& stop);
  bool IsAbove(double share) const;
  End Pass(const std::stop_token& stop);
  Result<std::vector<SessionRecord>> ListSessionsInMap() const;
  bool Step(std::int64_t from_ms, std::int64_t end_ms, const std::stop_token& stop);

  AtlasStore& store_;
  const Compact compact_;
  const LogSink log_;
  const AutomaticCompactionOptions options_;
  std::atomic<bool> is_on_ = false;
  std::int64_t from_ms_ = 0;  // where the next step begins
  std::jthread thread_;
};

}  // namespace atlas
