#include "server/service/compaction/automatic_compaction.h"

#include <exception>
#include <limits>
#include <utility>

#include "core/base/str_cat.h"
#include "server/base/stoppable_sleep.h"
#include "server/base/thread_priority.h"
#include "server/service/compaction/compaction_window.h"

namespace atlas {
namespace {

constexpr int kNice = 19;
constexpr std::uint32_t kPage = 1'024;

}  // namespace

AutomaticCompaction::AutomaticCompaction(AtlasStore& store,
                                         Compact compact,
                                         LogSink log,
                                         const AutomaticCompactionOptions& options)
    : store_(store),
      compact_(std::move(compact)),
      log_(std::move(log)),
      options_(options),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

void AutomaticCompaction::Stop() {
  thread_.request_stop();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void AutomaticCompaction::Run(const std::stop_token& stop) {
  YieldToOthers(kNice);
  std::chrono::steady_clock::time_point rested_at{};
  while (!SleepUnlessStopped(stop, options_.look_every)) {
    const auto now = std::chrono::steady_clock::now();
    if (now < rested_at || !is_on_ || !IsAbove(options_.begin_share)) {
      continue;
    }
    try {
      if (Pass(stop) == End::kNothingLeft) {
        rested_at = std::chrono::steady_clock::now() + options_.rest;
      }
    } catch (const std::exception& error) {
      log_(LogLevel::kError, StrCat("retention: ", error.what()));
    }
  }
}

bool AutomaticCompaction::IsAbove(double share) const {
  const RoomFigures room = store_.ReadRoom();
  return room.limits.store_bytes > 0 && static_cast<double>(room.used_bytes) >
                                            share * static_cast<double>(room.limits.store_bytes);
}

// From the oldest keyframes to the newest, as far as it takes; behind a step that failed the next
// time.
AutomaticCompaction::End AutomaticCompaction::Pass(const std::stop_token& stop) {
  const auto sessions = ListSessionsInMap();
  if (!sessions) {
    log_(LogLevel::kError, StrCat("retention: ", sessions.error().message()));
    return End::kNothingLeft;
  }
  while (!stop.stop_requested() && is_on_) {
    if (!IsAbove(options_.end_share)) {
      from_ms_ = 0;
      return End::kEnough;
    }
    const auto end_ms = EndOfWindow(*sessions, from_ms_, options_.step_keyframes);
    if (!end_ms) {
      from_ms_ = 0;
      log_(LogLevel::kWarning, StrCat("retention: the store stays above ", options_.end_share * 100,
                                      " % of retention.store_mib: no more keyframes can go"));
      return End::kNothingLeft;
    }
    const std::int64_t from_ms = std::exchange(from_ms_, *end_ms);
    if (!Step(from_ms, *end_ms, stop)) {
      return End::kInterrupted;
    }
  }
  return End::kInterrupted;
}

Result<std::vector<SessionRecord>> AutomaticCompaction::ListSessionsInMap() const {
  std::vector<SessionRecord> in_map;
  SessionKey after;
  while (true) {
    const auto page = store_.ListSessions(after, kPage);
    if (!page) {
      return Error(page.error());
    }
    if (page->empty()) {
      return in_map;
    }
    for (const SessionRecord& session : *page) {
      if (session.damage != SessionDamage::kNone) {
        return Error(StatusCode::kInvalidData, session.reason);
      }
      if (IsInMap(session.state) && session.keyframes > 0) {
        in_map.push_back(session);
      }
    }
    after = page->back().key;
  }
}

bool AutomaticCompaction::Step(std::int64_t from_ms,
                               std::int64_t end_ms,
                               const std::stop_token& stop) {
  const auto report = compact_({end_ms, kAuthor, from_ms}, stop);
  if (report) {
    if (report->stored.dropped > 0) {
      const RoomFigures room = store_.ReadRoom();
      log_(LogLevel::kInfo, StrCat("retention: ", report->stored.dropped, " keyframes of ",
                                   report->stored.bytes, " bytes dropped, ", room.used_bytes,
                                   " of ", room.limits.store_bytes, " bytes in use"));
    }
    return true;
  }
  if (!stop.stop_requested()) {
    log_(LogLevel::kWarning, StrCat("retention: keyframes stay: ", report.error().message()));
  }
  return false;
}

}  // namespace atlas
