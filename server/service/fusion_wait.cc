#include "server/service/fusion_wait.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;

// Each tile that is built is a change, and to count many marks takes long: then the next look comes
// when so many times as long has passed.
constexpr std::uint64_t kMany = 1'000;
constexpr int kRest = 9;

}  // namespace

Status FusionWait::CheckRunning(const std::stop_token& stop) const {
  if (changes_.is_closed()) {
    return Status(StatusCode::kUnavailable, "the daemon is shutting down");
  }
  if (stop.stop_requested()) {
    return Status(StatusCode::kUnavailable, "the peer is gone");
  }
  return {};
}

Result<FusionWait::End> FusionWait::Until(const std::function<bool(const DirtyState&)>& is_done,
                                          const Patience& patience) const {
  while (true) {
    const auto begin = Clock::now();
    const std::uint64_t seen = changes_.version();
    const Status start = fusion_.start_problem();
    auto state = store_.ReadDirtyState();
    if (!state) {
      return Error(state.error());
    }
    if (start.ok() && is_done(*state)) {
      return End{std::move(*state), {}, false};
    }
    if (start.ok() && state->failed_tiles.size() == state->dirty_tiles) {
      if (Status damage = damage_.WhatKeepsAll(state->failed_tiles); !damage.ok()) {
        return End{std::move(*state), std::move(damage), false};
      }
    }
    const auto end = Clock::now();
    if (!changes_.WaitPast(seen, patience.deadline, patience.stop)) {
      if (Status status = CheckRunning(patience.stop); !status.ok()) {
        return Error(std::move(status));
      }
      if (!start.ok()) {
        return Error(start);
      }
      return End{std::move(*state), {}, true};
    }
    if (state->dirty_tiles > kMany) {
      std::this_thread::sleep_until(std::min(end + kRest * (end - begin), patience.deadline));
    }
  }
}

Result<WaitOutcome> FusionWait::UntilClean(const Patience& patience) const {
  const auto end = Until([](const DirtyState& s) { return s.dirty_tiles == 0; }, patience);
  if (!end) {
    return Error(end.error());
  }
  return WaitOutcome{end->state.revision, end->state.dirty_tiles, end->is_timed_out, end->damage};
}

Result<WaitOutcome> FusionWait::UntilCleanInTime(const Patience& patience) const {
  auto outcome = UntilClean(patience);
  if (outcome && outcome->is_timed_out) {
    return Error(StatusCode::kTimeout, StrCat("the atlas is not clean: ", outcome->dirty_tiles,
                                              " tiles are to be fused"));
  }
  return outcome;
}

Status FusionWait::ForRevision(std::uint64_t revision, const Patience& patience) const {
  if (const std::uint64_t current = store_.revision(); revision > current) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("cannot wait for revision ", revision, ", the atlas is at ", current));
  }
  ATLAS_RETURN_IF_ERROR(store_.identity().CheckNotLost(revision));
  const auto end = Until(
      [revision](const DirtyState& s) { return s.dirty_tiles == 0 || s.oldest_since > revision; },
      patience);
  if (!end) {
    return end.error();
  }
  if (end->is_timed_out) {
    return Status(StatusCode::kTimeout, StrCat("tiles do not reflect revision ", revision, " yet: ",
                                               end->state.dirty_tiles, " are to be fused"));
  }
  return end->damage;
}

std::function<Status()> FusionWait::Check(const Patience& patience, std::string too_late) const {
  return [this, patience, too_late = std::move(too_late)] {
    ATLAS_RETURN_IF_ERROR(CheckRunning(patience.stop));
    return patience.is_over() ? Status(StatusCode::kTimeout, too_late) : Status();
  };
}

}  // namespace atlas
