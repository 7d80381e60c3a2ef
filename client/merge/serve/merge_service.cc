#include "client/merge/serve/merge_service.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kMaxPause{600'000};
constexpr int kMaxDoublings = 6;

}  // namespace

Status MergeServiceOptions::Validate() const {
  for (const auto& [name, time] :
       {std::pair<const char*, milliseconds>{"every", every}, {"recheck", recheck}}) {
    if (time.count() <= 0) {
      return {StatusCode::kInvalidArgument, StrCat(name, ": ", time.count(), " ms, expected more")};
    }
  }
  if (settle.count() < 0) {
    return {StatusCode::kInvalidArgument,
            StrCat("settle: ", settle.count(), " ms, expected at least 0")};
  }
  ATLAS_RETURN_IF_ERROR(merge.Validate());
  return limits.Validate();
}

MergeService::MergeService(LinkOptions link,
                           MergeServiceOptions options,
                           MergeServiceEnvironment environment)
    : options_(std::move(options)),
      environment_(std::move(environment)),
      daemon_(std::move(link), environment_),
      merge_(daemon_, tried_, options_, environment_),
      settled_(options_.settle) {}

Status MergeService::Run() {
  if (options_.is_once) return RunOnce();
  while (!environment_.is_stopping()) {
    const auto client = daemon_.Wait();
    if (!daemon_.refusal().ok()) return daemon_.refusal();
    if (!client) continue;  // it is to stop
    const Status status = Round(**client);
    failed_rounds_ = status.ok() ? 0 : failed_rounds_ + 1;
    environment_.sleep(Pause());
  }
  return {};
}

Status MergeService::RunOnce() {
  constexpr std::chrono::seconds kPatience{10};
  auto client = daemon_.Wait(environment_.now() + kPatience);
  if (!client) return environment_.is_stopping() ? Status() : client.error();
  ForgetOtherEpochs((*client)->atlas().epoch);
  ATLAS_RETURN_IF_ERROR(LookAtSessions(**client));
  environment_.sleep(options_.settle);
  client = daemon_.Wait(environment_.now() + kPatience);
  if (!client) return environment_.is_stopping() ? Status() : client.error();
  const Status status = Round(**client);
  if (environment_.is_stopping()) return {};
  return status.ok() ? merge_.failure() : status;
}

Status MergeService::Round(AtlasClient& client) {
  ForgetOtherEpochs(client.atlas().epoch);
  Status status = LookAtSessions(client);
  if (!status.ok()) return status;
  const Clock::time_point now = environment_.now();
  Settled settled = settled_.Settled(now);
  if (IsDoneWith(settled, now)) return {};
  const auto known = ReadKnown(client, settled);
  if (!known) return known.error();
  tried_.ForgetOthers(*known);
  const std::uint64_t revision = *seen_revision_;
  if (const auto keys = tried_.WorthTrying(*known); !keys.empty()) {
    done_with_.reset();
    ATLAS_RETURN_IF_ERROR(merge_.Run(keys, *known, revision));
    // By what it knew: the next round knows more.
    if (!tried_.WorthTrying(*known).empty()) return {};
  }
  done_with_ = std::move(settled);
  done_revision_ = revision;
  done_at_ = now;
  return {};
}

Status MergeService::Reported(const Status& status) {
  if (!daemon_.Report(status)) {
    environment_.on_event({.kind = MergeEventKind::kPutOff, .status = status});
  }
  return status;
}

Status MergeService::LookAtSessions(AtlasClient& client) {
  const auto status = client.ReadStatus();
  if (!status) return Reported(status.error());
  if (seen_revision_ == status->revision) return {};
  const auto sessions = client.ListSessions();
  if (!sessions) return Reported(sessions.error());
  (void)daemon_.Report({});
  settled_.Look(*sessions, environment_.now());
  seen_revision_ = status->revision;
  return {};
}

bool MergeService::IsDoneWith(const Settled& settled, Clock::time_point now) const {
  const bool is_any_staged = std::any_of(settled.begin(), settled.end(),
                                         [](const auto& one) { return one.second.IsStaged(); });
  if (!is_any_staged) return true;
  if (done_with_ != settled) return false;
  return done_revision_ == seen_revision_ || now - done_at_ < options_.recheck;
}

Result<KnownSessions> MergeService::ReadKnown(AtlasClient& client, const Settled& settled) {
  const auto sessions = client.ListSessions({}, SessionDetail::kChanges);
  if (!sessions) return Error(Reported(sessions.error()));
  KnownSessions known;
  for (const SessionSummary& session : *sessions) {
    const SessionMark mark = MarkOf(session);
    const auto before = settled.find(session.key);
    const bool is_closed = before != settled.end() && before->second == mark;
    known[session.key] = {mark.IsStaged(), mark.IsInMap(), is_closed, session.changed_revision};
  }
  return known;
}

milliseconds MergeService::Pause() const {
  const milliseconds longer = options_.every * (1 << std::min(failed_rounds_, kMaxDoublings));
  return std::min(longer, std::max(options_.every, kMaxPause));
}

// A restored backup counts its revisions on from earlier ones.
void MergeService::ForgetOtherEpochs(std::uint64_t epoch) {
  if (std::exchange(epoch_, epoch) == epoch) return;
  tried_ = {};
  settled_ = SettledSessions(options_.settle);
  seen_revision_.reset();
  done_with_.reset();
}

}  // namespace atlas
