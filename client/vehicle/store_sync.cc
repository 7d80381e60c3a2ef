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

// The budget and the time of several requests.
class Allowance {
 public:
  explicit Allowance(const SyncQuery& query)
      : budget_bytes_(query.budget_bytes), timeout_(query.timeout), start_(Clock::now()) {}

  // False when nothing is left for another one.
  bool Leave(std::uint64_t used_bytes, SyncQuery& query) const {
    if (budget_bytes_ != 0 && used_bytes >= budget_bytes_) return false;
    if (budget_bytes_ != 0) query.budget_bytes = budget_bytes_ - used_bytes;
    if (timeout_.count() == 0) return true;
    query.timeout = timeout_ - std::chrono::duration_cast<milliseconds>(Clock::now() - start_);
    return query.timeout.count() > 0;
  }

 private:
  std::uint64_t budget_bytes_;
  milliseconds timeout_;
  Clock::time_point start_;
};

struct Answer {
  SyncSummary summary;
  bool has_lost_bases = false;  // of deltas: these tiles are not held now, and come as a whole
};

Result<Answer> Ask(AtlasClient& client, TileStore& store, SyncQuery& query) {
  query.held = store.Held(query.area, query.finest_level, CoarsestOf(query, store.atlas().profile));
  Answer answer;
  Result<SyncSummary> reply = client.Sync(query, [&](const TileBlob& tile) {
    Status status = store.Put(tile, query.sections);
    const bool is_lost = !status.ok() && tile.base_hash != 0;
    answer.has_lost_bases |= is_lost;
    return is_lost ? Status() : status;
  });
  if (!reply) return Error(reply.error());
  store.Apply(*reply);
  answer.summary = *std::move(reply);
  return answer;
}

}  // namespace

Result<StoreSyncReport> SyncStore(AtlasClient& client, TileStore& store, SyncQuery query) {
  if (client.atlas().atlas_id != store.atlas().atlas_id ||
      client.profile() != store.atlas().profile) {
    return Error(StatusCode::kConflict, "tile store: the daemon serves another atlas");
  }
  const Allowance allowance(query);
  query.cursor.clear();
  query.takes_deltas = true;
  StoreSyncReport report;
  while (allowance.Leave(report.bytes, query)) {
    const Result<Answer> answer = Ask(client, store, query);
    // What is left of the budget may be too little for anything.
    const bool is_spent = report.requests > 0 && !answer && query.budget_bytes != 0 &&
                          answer.error().code() == StatusCode::kInvalidArgument;
    if (is_spent) break;
    if (!answer) return Error(answer.error());
    const SyncSummary& reply = answer->summary;
    ++report.requests;
    report.tiles += reply.tiles;
    report.deltas += reply.deltas;
    report.bytes += reply.bytes;
    if (report.requests == 1) report.revision = reply.revision;
    query.wait_revision = 0;
    const bool is_told_anew = !reply.differing_blocks.empty() || answer->has_lost_bases;
    report.is_complete = !is_told_anew && reply.cursor.empty();
    if (report.is_complete || (!is_told_anew && reply.tiles == 0)) break;
    query.cursor = is_told_anew ? Bytes() : reply.cursor;
  }
  return report;
}

}  // namespace atlas
