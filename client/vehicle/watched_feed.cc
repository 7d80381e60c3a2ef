#include "client/vehicle/watched_feed.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace atlas {

using std::chrono::milliseconds;

bool WatchedFeed::Covers(const DiscArea& disc, const AroundOptions& options) const {
  return watched_ && watched_->finest_level == options.finest_level &&
         watched_->sections == options.sections &&
         (disc.center_m - watched_->disc.center_m).norm() + disc.radius_m <=
             watched_->disc.radius_m;
}

void WatchedFeed::Begin(AtlasClient& client, const DiscArea& disc, const AroundOptions& options) {
  settled_.reset();
  watch_.reset();
  watched_ = {
      {disc.center_m, disc.radius_m + options_.margin_m}, options.finest_level, options.sections};
  if (Clock::now() < next_watch_) return;
  WatchQuery query;
  query.area = watched_->disc;
  query.finest_level = options.finest_level;
  query.interval = options_.interval;
  Result<AtlasWatch> watch = client.Watch(query, options.deadline / 4);
  if (watch) {
    watch_ = *std::move(watch);
    Listen(options.deadline / 4);
  } else {
    next_watch_ = Clock::now() + options_.watch_pause;
  }
}

void WatchedFeed::Listen(milliseconds time) {
  const auto changes = watch_->Next(time);
  if (changes && (!*changes || (*changes)->empty())) return;
  settled_.reset();
  if (changes) return;
  // Without it every call asks.
  if (!watch_->end().ok()) next_watch_ = Clock::now() + options_.watch_pause;
  link_.Report(changes.error());
  watch_.reset();
}

bool WatchedFeed::IsQuiet(const TileStore& store) {
  if (!settled_ || !watch_) return false;
  Listen(milliseconds(0));
  return settled_ && settled_->store == &store && settled_->store_changes == store.changes() &&
         Clock::now() - settled_->since < options_.max_silence;
}

Result<StoreSyncReport> WatchedFeed::Sync(TileStore& store,
                                          const MapArea& area,
                                          const AroundOptions& options) {
  const auto* disc = std::get_if<DiscArea>(&area);
  if (disc == nullptr) return feed_.Sync(store, area, options);
  const Clock::time_point start = Clock::now();
  const Result<AtlasClient*> client = link_.Client(options.deadline);
  if (!client) return Error(client.error());
  const bool is_watch_due = !watch_ && start >= next_watch_;
  if (!Covers(*disc, options) || is_watch_due) {
    // On a slow link what is on its way is most of what there is: it comes first.
    if (feed_.is_under_way()) {
      settled_.reset();
      return feed_.Sync(store, *disc, options);
    }
    Begin(**client, *disc, options);
  }
  if (IsQuiet(store)) {
    StoreSyncReport report;
    report.revision = settled_->revision;
    report.is_complete = true;
    return report;
  }
  settled_.reset();
  const bool is_watched = watch_ && watch_->since();
  const std::uint64_t store_changes = store.changes();
  AroundOptions rest = options;
  const auto spent = std::chrono::duration_cast<milliseconds>(Clock::now() - start);
  rest.deadline = std::max(options.deadline - spent, milliseconds(1));
  Result<StoreSyncReport> report = feed_.Sync(store, had_room_ ? watched_->disc : *disc, rest);
  had_room_ &= !report || report->has_room;
  const bool is_all =
      had_room_ && report && report->is_complete && store.changes() == store_changes;
  if (is_all && is_watched) settled_ = {&store, store_changes, report->revision, Clock::now()};
  return report;
}

}  // namespace atlas
