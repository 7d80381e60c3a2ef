#include "client/vehicle/store_sync.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

std::uint8_t CoarsestOf(const SyncQuery& query, const MapProfile& profile) {
  const auto last = static_cast<std::uint8_t>(profile.levels - 1);
  return query.coarsest_level == 0 ? last : query.coarsest_level;
}

// The budget and the times of several requests.
class Allowance {
 public:
  explicit Allowance(const SyncQuery& query)
      : budget_bytes_(query.budget_bytes),
        timeout_(query.timeout),
        give_up_(query.give_up),
        start_(Clock::now()) {}

  // False when nothing is left for another one.
  bool Leave(std::uint64_t used_bytes, SyncQuery& query) const {
    if (budget_bytes_ != 0 && used_bytes >= budget_bytes_) return false;
    if (budget_bytes_ != 0) query.budget_bytes = budget_bytes_ - used_bytes;
    const auto spent = std::chrono::duration_cast<milliseconds>(Clock::now() - start_);
    return Shorten(timeout_, spent, query.timeout) && Shorten(give_up_, spent, query.give_up);
  }

 private:
  // False when nothing is left of a time that has an end.
  static bool Shorten(milliseconds time, milliseconds spent, milliseconds& left) {
    if (time.count() == 0) return true;
    left = time - spent;
    return left.count() > 0;
  }

  std::uint64_t budget_bytes_;
  milliseconds timeout_;
  milliseconds give_up_;
  Clock::time_point start_;
};

// The replies of one call, into the store.
class Transfer {
 public:
  Transfer(AtlasClient& client, TileStore& store)
      : client_(client), store_(store), bytes_before_(client.bytes_received()) {}

  // `rest`: what is on its way afterwards.
  Result<SyncSummary> Ask(SyncQuery& query, StoreSyncRest& rest) {
    const std::uint8_t coarsest = CoarsestOf(query, store_.atlas().profile);
    rest.asked.sections = query.sections;
    query.held = store_.Held(query.area, query.finest_level, coarsest, rest.asked.but_held);
    Result<SyncSummary> reply = client_.Sync(query, Into(rest.asked));
    if (!reply) return reply;
    rest.reply = reply->rest;
    ++report_.requests;
    if (report_.requests == 1) report_.revision = reply->revision;
    if (reply->rest == nullptr) store_.Apply(*reply);
    return reply;
  }

  // As far as the time goes. What was given up meanwhile is no failure.
  Status Finish(StoreSyncRest& rest, milliseconds give_up) {
    if (rest.reply == nullptr) return {};
    const auto reply = client_.Continue(std::move(rest.reply), give_up, Into(rest.asked));
    rest.reply = reply ? reply->rest : nullptr;
    if (reply && reply->rest == nullptr) store_.Apply(*reply);
    const bool is_failure = !reply && reply.error().code() != StatusCode::kNotFound;
    return is_failure ? reply.error() : Status();
  }

  // Of tiles in the last reply: they are not told any more, and come as a whole.
  bool has_lost_bases() const { return has_lost_bases_; }
  std::uint64_t bytes() const { return client_.bytes_received() - bytes_before_; }
  StoreSyncReport Report(bool is_complete) const {
    StoreSyncReport report = report_;
    report.bytes = bytes();
    report.is_complete = is_complete;
    return report;
  }

 private:
  AtlasClient::TileCallback Into(const AskedSections& asked) {
    has_lost_bases_ = false;
    return [this, &asked](const TileBlob& tile) {
      const bool is_delta = tile.base_hash != 0;
      ++report_.tiles;
      report_.deltas += is_delta ? 1U : 0U;
      Status status = store_.Put(tile, asked);
      const bool is_unread = !status.ok() && status.code() != StatusCode::kInvalidData;
      const bool is_lost = is_unread || (!status.ok() && is_delta);
      has_lost_bases_ |= is_lost;
      return is_lost ? Status() : status;
    };
  }

  AtlasClient& client_;
  TileStore& store_;
  std::uint64_t bytes_before_;
  StoreSyncReport report_;
  bool has_lost_bases_ = false;
};

}  // namespace

Result<StoreSyncReport> SyncStore(AtlasClient& client,
                                  TileStore& store,
                                  SyncQuery query,
                                  StoreSyncRest& rest) {
  if (client.atlas().atlas_id != store.atlas().atlas_id ||
      client.profile() != store.atlas().profile) {
    return Error(StatusCode::kConflict, "tile store: the daemon serves another atlas");
  }
  const Allowance allowance(query);
  query.cursor.clear();
  query.takes_deltas = true;
  Transfer transfer(client, store);
  if (Status status = transfer.Finish(rest, query.give_up); !status.ok()) {
    return Error(std::move(status));
  }
  while (rest.reply == nullptr && allowance.Leave(transfer.bytes(), query)) {
    const Result<SyncSummary> reply = transfer.Ask(query, rest);
    // What is left of the budget may be too little for anything.
    const bool is_spent = transfer.bytes() > 0 && !reply && query.budget_bytes != 0 &&
                          reply.error().code() == StatusCode::kInvalidArgument;
    if (is_spent) break;
    if (!reply) return Error(reply.error());
    if (rest.reply != nullptr) break;
    query.wait_revision = 0;
    const bool is_told_anew = !reply->differing_blocks.empty() || transfer.has_lost_bases();
    if (!is_told_anew && reply->cursor.empty()) return transfer.Report(true);
    if (!is_told_anew && reply->tiles == 0) break;
    query.cursor = is_told_anew ? Bytes() : reply->cursor;
  }
  return transfer.Report(false);
}

Result<StoreSyncReport> SyncStore(AtlasClient& client, TileStore& store, SyncQuery query) {
  StoreSyncRest rest;
  return SyncStore(client, store, std::move(query), rest);
}

}  // namespace atlas
