#include "server/service/region/region_query.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

Result<RegionQuery> RegionQuery::Create(std::shared_ptr<TileView> tiles,
                                        const RegionRequest& request,
                                        Options options) {
  const std::uint32_t levels = tiles->profile().levels;
  const std::uint32_t coarsest =
      request.coarsest_level == 0 ? levels - 1 : std::min(request.coarsest_level, levels - 1);
  if (request.finest_level > coarsest) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("region query: finest level ", request.finest_level,
                        ", expected 0 to the coarsest, ", coarsest));
  }
  if (request.budget_bytes != 0 && request.budget_bytes < options.end_bytes) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("region query: budget of ", request.budget_bytes,
                        " bytes, expected at least ", options.end_bytes));
  }
  RegionQuery query(std::move(tiles), request, std::move(options));
  query.level_ = request.only_finest ? request.finest_level : coarsest;
  query.last_level_ = request.finest_level;
  return query;
}

RegionQuery::RegionQuery(std::shared_ptr<TileView> tiles,
                         const RegionRequest& request,
                         Options options)
    : tiles_(std::move(tiles)), request_(request), options_(std::move(options)) {
  if (request_.disc) {
    request_.disc = ClampedToWorld(*request_.disc);
  }
}

Result<std::optional<StoredTile>> RegionQuery::Next() {
  while (!is_truncated_) {
    if (candidates_.empty()) {
      if (is_level_listed_ && !NextLevel()) {
        return std::nullopt;
      }
      if (Status status = FillCandidates(); !status.ok()) {
        return Error(std::move(status));
      }
      continue;
    }
    const auto id = TileId::FromKey(candidates_.front().key);
    candidates_.pop_front();
    last_tried_ = id.value();
    auto tile = tiles_->Read(*id);
    if (!tile) {
      return Error(tile.error());
    }
    if (*tile) {  // else it became empty since it was listed
      return Take(std::move(**tile));
    }
  }
  return std::nullopt;
}

Result<std::optional<StoredTile>> RegionQuery::Take(StoredTile tile) {
  const std::uint64_t cost = options_.tile_cost(tile);
  if (request_.budget_bytes != 0 &&
      used_bytes_ + cost + options_.end_bytes > request_.budget_bytes) {
    is_truncated_ = true;
    return std::nullopt;
  }
  used_bytes_ += cost;
  return tile;
}

bool RegionQuery::NextLevel() {
  if (level_ == last_level_) {
    return false;
  }
  --level_;
  last_.reset();
  is_level_listed_ = false;
  return true;
}

// The nearest candidates after last_, as many as are kept at a time.
Status RegionQuery::FillCandidates() {
  std::set<Candidate> nearest;
  ATLAS_RETURN_IF_ERROR(tiles_->Scan(Rect(), [&](const TileId& id) {
    const auto candidate = ToCandidate(id);
    if (!candidate || (last_ && *candidate <= *last_)) {
      return;
    }
    nearest.insert(*candidate);
    if (nearest.size() > options_.max_candidates) {
      nearest.erase(std::prev(nearest.end()));
    }
  }));
  is_level_listed_ = nearest.size() < options_.max_candidates;
  candidates_.assign(nearest.begin(), nearest.end());
  if (!candidates_.empty()) {
    last_ = candidates_.back();
  }
  return {};
}

// nullopt: outside of the disc.
std::optional<RegionQuery::Candidate> RegionQuery::ToCandidate(const TileId& id) const {
  if (!request_.disc) {
    return Candidate{0, id.Key()};
  }
  const auto distance = SquaredDistance(*request_.disc, id, tiles_->profile());
  return distance ? std::optional(Candidate{*distance, id.Key()}) : std::nullopt;
}

TileRect RegionQuery::Rect() const {
  const auto level = static_cast<std::uint8_t>(level_);
  return request_.disc ? RectAround(*request_.disc, level, tiles_->profile()) : TileRect{level};
}

}  // namespace atlas
