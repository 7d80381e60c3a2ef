#include "client/merge/serve/unattended_merge.h"

#include <algorithm>
#include <utility>

#include "client/merge/source/session_source.h"

namespace atlas {
namespace {

constexpr std::chrono::seconds kTellEvery{60};
constexpr int kApplyAttempts = 3;  // over as many connections

// Whether it may be otherwise the next time, whatever the sessions are.
bool IsForNow(StatusCode code) {
  return IsTemporary(code) || code == StatusCode::kConflict || code == StatusCode::kNotFound ||
         code == StatusCode::kPermissionDenied;
}

// Of a daemon's sessions those that nobody uploads to: others would be a conflict in the end.
class ClosedSessions : public DaemonSessions {
 public:
  ClosedSessions(AtlasClient& client, const KnownSessions& known)
      : DaemonSessions(client), known_(known) {}

  Result<std::vector<SessionSummary>> ListSessions() override {
    auto sessions = DaemonSessions::ListSessions();
    if (!sessions) return sessions;
    std::erase_if(*sessions, [&](const SessionSummary& session) {
      const auto known = known_.find(session.key);
      return known == known_.end() || !known->second.is_closed;
    });
    return sessions;
  }

 private:
  const KnownSessions& known_;
};

}  // namespace

UnattendedMerge::UnattendedMerge(WatchedDaemon& daemon,
                                 TriedSessions& tried,
                                 const MergeServiceOptions& options,
                                 const MergeServiceEnvironment& environment)
    : daemon_(daemon), tried_(tried), options_(options), environment_(environment) {}

Status UnattendedMerge::Run(const std::vector<SessionKey>& keys,
                            const KnownSessions& known,
                            std::uint64_t revision) {
  known_ = &known;
  known_revision_ = revision;
  unmet_.clear();
  is_split_ = false;
  put_off_ = Status();
  Fate fate = MergeInParts(keys);
  // Those of two parts were not looked for in each other.
  if (fate == Fate::kDone && is_split_ && unmet_.size() > 1) {
    fate = Merge({unmet_.begin(), unmet_.end()});
  }
  return fate == Fate::kPutOff ? put_off_ : Status();
}

UnattendedMerge::Fate UnattendedMerge::MergeInParts(const std::vector<SessionKey>& keys) {
  const Fate fate = Merge(keys);
  if (fate != Fate::kUnfit) return fate;
  is_split_ = true;
  const auto middle = keys.begin() + static_cast<std::ptrdiff_t>(keys.size() / 2);
  const Fate first = MergeInParts({keys.begin(), middle});
  return first == Fate::kDone ? MergeInParts({middle, keys.end()}) : first;
}

UnattendedMerge::Fate UnattendedMerge::Merge(const std::vector<SessionKey>& keys) {
  const auto client = daemon_.Wait();
  if (!client) return PutOff(keys, client.error());
  const std::uint64_t epoch = (*client)->atlas().epoch;
  environment_.on_event({.kind = MergeEventKind::kBegun, .sessions = keys});
  told_ = environment_.now();
  ClosedSessions source(**client, *known_);
  auto work = options_.work.empty()
                  ? MergeWork::Temporary()
                  : MergeWork::Open(options_.work, kAlignmentRules, options_.max_work_bytes);
  if (!work) return PutOff(keys, work.error());
  auto run = RunMerge(source, keys, options_.merge, *work,
                      [this](std::string_view step, std::size_t done, std::size_t all) {
                        return GoOn(step, done, all);
                      });
  const bool is_link_lost = daemon_.Report(run ? Status() : run.error());
  if (run) {
    run->revision = std::min(run->revision, known_revision_);
    return Conclude(keys, *run, epoch);
  }
  const bool is_for_now =
      is_link_lost || environment_.is_stopping() || IsForNow(run.error().code());
  return is_for_now ? PutOff(keys, run.error()) : Failed(keys, run.error());
}

UnattendedMerge::Fate UnattendedMerge::Conclude(const std::vector<SessionKey>& keys,
                                                const MergeRun& run,
                                                std::uint64_t epoch) {
  if (run.IsNothing()) {
    NoteUnmet(keys, run, 0);
    environment_.on_event({.kind = MergeEventKind::kNothing, .sessions = keys, .run = &run});
    return Fate::kDone;
  }
  std::vector<LimitBreach> breaches = CheckLimits(run, options_.limits);
  if (!breaches.empty()) return OverLimits(keys, run, std::move(breaches));
  auto batch = Apply(run, epoch);
  if (!batch) return PutOff(keys, batch.error());
  NoteUnmet(keys, run, batch->revision);
  environment_.on_event({.kind = MergeEventKind::kApplied,
                         .sessions = keys,
                         .run = &run,
                         .batch = *std::move(batch)});
  return Fate::kApplied;
}

UnattendedMerge::Fate UnattendedMerge::OverLimits(const std::vector<SessionKey>& keys,
                                                  const MergeRun& run,
                                                  std::vector<LimitBreach> breaches) {
  std::set<SessionKey> about;
  for (const LimitBreach& breach : breaches) {
    for (const SessionKey& key : breach.sessions) {
      if (known_->contains(key)) about.insert(key);
    }
  }
  return Unfit({.kind = MergeEventKind::kOverLimits,
                .sessions = keys,
                .run = &run,
                .breaches = std::move(breaches)},
               about);
}

// It may be due to the map as well.
UnattendedMerge::Fate UnattendedMerge::Failed(const std::vector<SessionKey>& keys,
                                              const Status& status) {
  std::set<SessionKey> about;
  for (const auto& [key, session] : *known_) {
    if (session.is_in_map) about.insert(key);
  }
  if (keys.size() == 1 && failure_.ok()) failure_ = status;
  return Unfit({.kind = MergeEventKind::kFailed, .sessions = keys, .status = status}, about);
}

UnattendedMerge::Fate UnattendedMerge::Unfit(const MergeEvent& event,
                                             const std::set<SessionKey>& about) {
  if (event.sessions.size() == 1) {
    tried_.SetAside(event.sessions.front(), *known_, about);
    environment_.on_event(event);
    return Fate::kDone;
  }
  environment_.on_event({.kind = MergeEventKind::kSplit,
                         .sessions = event.sessions,
                         .breaches = event.breaches,
                         .status = event.status});
  return Fate::kUnfit;
}

UnattendedMerge::Fate UnattendedMerge::PutOff(const std::vector<SessionKey>& keys,
                                              const Status& status) {
  put_off_ = status;
  if (!environment_.is_stopping()) {
    environment_.on_event({.kind = MergeEventKind::kPutOff, .sessions = keys, .status = status});
  }
  return Fate::kPutOff;
}

Result<PoseBatchSummary> UnattendedMerge::Apply(const MergeRun& run, std::uint64_t epoch) {
  for (int attempt = 1;; ++attempt) {
    const auto client = daemon_.Wait();
    if (!client) return Error(client.error());
    if ((*client)->atlas().epoch != epoch) {
      return Error(StatusCode::kConflict, "the atlas was restored from a backup meanwhile");
    }
    auto batch = ApplyMerge(run, **client, options_.author);
    const bool is_link_lost = daemon_.Report(batch ? Status() : batch.error());
    // A batch that was applied before its reply got lost is a conflict the second time.
    if (batch || !is_link_lost || attempt == kApplyAttempts) return batch;
  }
}

void UnattendedMerge::NoteUnmet(const std::vector<SessionKey>& keys,
                                const MergeRun& run,
                                std::uint64_t applied) {
  std::set<SessionKey> unmet(keys.begin(), keys.end());
  for (const SessionKey& key : run.Published()) {
    unmet.erase(key);
  }
  for (std::size_t i = 0; i < run.sessions.size(); ++i) {
    const SessionKey& key = run.sessions[i].key;
    if (!run.plan.sessions[i].is_refused || unmet.erase(key) == 0) continue;
    tried_.Refused(key, *known_);
  }
  for (const SessionKey& key : unmet) {
    tried_.MetNobody(key, *known_, {run.revision, applied});
  }
  unmet_.merge(unmet);
}

Status UnattendedMerge::GoOn(std::string_view step, std::size_t done, std::size_t all) {
  if (environment_.is_stopping()) return {StatusCode::kUnavailable, "it is to stop"};
  const auto now = environment_.now();
  if (now - told_ >= kTellEvery) {
    told_ = now;
    environment_.on_event(
        {.kind = MergeEventKind::kGoesOn, .step = step, .done = done, .all = all});
  }
  return {};
}

}  // namespace atlas
