#include "client/connection/atlas_watch.h"

#include <algorithm>
#include <utility>

#include "client/connection/area_message.h"
#include "client/connection/rpc_channel.h"
#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

Result<AreaChanges> ChangesFromWire(const wire::WatchEvent& event) {
  if (event.keys_size() != event.revisions_size()) {
    return Error(StatusCode::kInvalidData,
                 StrCat("watch: the daemon told ", event.keys_size(), " tiles with ",
                        event.revisions_size(), " revisions"));
  }
  AreaChanges changes;
  changes.revision = event.revision();
  changes.is_anything = event.anything();
  for (int i = 0; i < event.keys_size(); ++i) {
    const Result<TileId> id = TileId::FromKey(event.keys(i));
    if (!id) return Error(id.error());
    if (event.revisions(i) == 0) {
      changes.removed.insert(*id);
    } else {
      changes.changed[*id] = event.revisions(i);
    }
  }
  for (const std::uint64_t key : event.below()) {
    const Result<TileId> id = TileId::FromKey(key);
    if (!id) return Error(id.error());
    changes.below.insert(*id);
  }
  return changes;
}

}  // namespace

void AreaChanges::Add(const AreaChanges& later) {
  revision = later.revision;
  for (const auto& [id, its_revision] : later.changed) {
    removed.erase(id);
    changed[id] = its_revision;
  }
  for (const TileId& id : later.removed) {
    changed.erase(id);
    removed.insert(id);
  }
  below.insert(later.below.begin(), later.below.end());
  is_anything =
      is_anything || later.is_anything || changed.size() + removed.size() + below.size() > kMaxTold;
  if (!is_anything) return;
  changed.clear();
  removed.clear();
  below.clear();
}

struct AtlasWatch::State {
  std::weak_ptr<RpcChannel> channel;
  std::uint64_t id = 0;
  std::optional<std::uint64_t> since;
  std::optional<AreaChanges> told;  // and not fetched
  Status end;

  Status OnReply(const wire::Envelope& reply) {
    if (reply.has_error()) {
      end = ErrorFromWire(reply.error()).status;
      return {};
    }
    if (!reply.has_watch_event()) {
      return {StatusCode::kInvalidData, "watch: the daemon answered with something else"};
    }
    const Result<AreaChanges> changes = ChangesFromWire(reply.watch_event());
    if (!changes) return changes.error();
    if (!since) since = changes->revision;
    if (told) {
      told->Add(*changes);
    } else {
      told.emplace().Add(*changes);
    }
    return {};
  }
};

AtlasWatch::AtlasWatch(std::shared_ptr<State> state) : state_(std::move(state)) {}
AtlasWatch::AtlasWatch(AtlasWatch&&) noexcept = default;

AtlasWatch& AtlasWatch::operator=(AtlasWatch&& other) noexcept {
  std::swap(state_, other.state_);
  return *this;
}

AtlasWatch::~AtlasWatch() {
  const auto channel = state_ == nullptr ? nullptr : state_->channel.lock();
  if (channel == nullptr) return;
  if (state_->end.ok() && !channel->is_broken()) {
    channel->Cancel(state_->id);
  } else {
    channel->Forget(state_->id);
  }
}

Result<AtlasWatch> AtlasWatch::Begin(const std::shared_ptr<RpcChannel>& channel,
                                     const WatchQuery& query,
                                     Clock::time_point latest) {
  wire::Envelope envelope;
  wire::WatchRequest& request = *envelope.mutable_watch_request();
  Status status = AreaToWire(query.area, *request.mutable_area());
  if (!status.ok()) return Error(std::move(status));
  request.set_finest_level(query.finest_level);
  request.set_coarsest_level(query.coarsest_level);
  request.set_interval_ms(static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(query.interval.count(), 0, INT64_C(0xFFFFFFFF))));
  const Result<std::uint64_t> id = channel->Send(envelope, latest);
  if (!id) return Error(id.error());
  const auto state = std::make_shared<State>();
  state->channel = channel;
  state->id = *id;
  channel->Listen(*id, RpcChannel::Kind::kEvent,
                  [state](const wire::Envelope& reply) { return state->OnReply(reply); });
  return AtlasWatch(state);
}

Result<std::optional<AreaChanges>> AtlasWatch::Next(milliseconds timeout) {
  const Clock::time_point latest = Clock::now() + timeout;
  State& state = *state_;
  while (!state.told) {
    if (!state.end.ok()) return Error(state.end);
    const auto channel = state.channel.lock();
    if (channel == nullptr) {
      return Error(StatusCode::kUnavailable, "watch: its connection is gone");
    }
    const Result<bool> is_told = channel->Hear(latest, RpcChannel::Kind::kEvent);
    if (!is_told) return Error(is_told.error());
    const bool is_late = !*is_told || Clock::now() >= latest;
    if (is_late && !state.told && state.end.ok()) return std::nullopt;
  }
  return std::exchange(state.told, std::nullopt);
}

const std::optional<std::uint64_t>& AtlasWatch::since() const {
  return state_->since;
}

const Status& AtlasWatch::end() const {
  return state_->end;
}

}  // namespace atlas
