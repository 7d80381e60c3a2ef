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

// Every mark that is left was tried since it was set, and damage was why it failed.
bool FusionWait::IsStuck(const DirtyState& state) const {
  return state.dirty_tiles != 0 && state.failed_tiles == state.dirty_tiles &&
         damage_.size() >= state.dirty_tiles;
}

Result<FusionWait::End> FusionWait::Until(const std::function<bool(const DirtyState&)>& is_done,
                                          const Patience& patience,
                                          DirtyState& state) const {
  while (true) {
    const auto begin = Clock::now();
    const std::uint64_t seen = changes_.version();
    const Status start = fusion_.start_problem();
    const auto read = store_.ReadDirtyState();
    if (!read) {
      return Error(read.error());
    }
    state = *read;
    if (start.ok() && is_done(state)) {
      return End::kDone;
    }
    if (start.ok() && IsStuck(state)) {
      return End::kDamaged;
    }
    const auto end = Clock::now();
    if (!changes_.WaitPast(seen, patience.deadline, patience.stop)) {
      if (Status status = CheckRunning(patience.stop); !status.ok()) {
        return Error(std::move(status));
      }
      if (!start.ok()) {
        return Error(start);
      }
      return End::kTimedOut;
    }
    if (state.dirty_tiles > kMany) {
      std::this_thread::sleep_until(std::min(end + kRest * (end - begin), patience.deadline));
    }
  }
}

Result<WaitOutcome> FusionWait::UntilClean(const Patience& patience) const {
  DirtyState state;
  const auto end = Until([](const DirtyState& s) { return s.dirty_tiles == 0; }, patience, state);
  if (!end) {
    return Error(end.error());
  }
  WaitOutcome outcome{state.revision, state.dirty_tiles, *end == End::kTimedOut, {}};
  if (*end == End::kDamaged) {
    outcome.damage = damage_.Summary();
  }
  return outcome;
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
  DirtyState state;
  const auto end = Until(
      [revision](const DirtyState& s) { return s.dirty_tiles == 0 || s.oldest_since > revision; },
      patience, state);
  if (!end) {
    return end.error();
  }
  if (*end == End::kDamaged) {
    return damage_.Summary();
  }
  if (*end == End::kTimedOut) {
    return Status(StatusCode::kTimeout, StrCat("tiles do not reflect revision ", revision,
                                               " yet: ", state.dirty_tiles, " are to be fused"));
  }
  return {};
}

std::function<Status()> FusionWait::Check(const Patience& patience, std::string too_late) const {
  return [this, patience, too_late = std::move(too_late)] {
    ATLAS_RETURN_IF_ERROR(CheckRunning(patience.stop));
    return patience.is_over() ? Status(StatusCode::kTimeout, too_late) : Status();
  };
}

}  // namespace atlas
