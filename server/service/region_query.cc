#include "server/service/region_query.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// Beyond the world: positions are within 10,000 km.
constexpr std::int64_t kMaxExtent_um = 100'000'000'000'000;

std::int64_t Clamped(std::int64_t value) {
  return std::clamp(value, -kMaxExtent_um, kMaxExtent_um);
}

std::int32_t TileCoordinate(std::int64_t position_um, std::int64_t side_um) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(
      FloorDiv(position_um, side_um), TileId::kMinCoordinate, TileId::kMaxCoordinate));
}

// The lower edge of a tile; a coordinate out of this world ends at its border.
std::int64_t Edge(std::int32_t coordinate, std::int64_t side_um) {
  const Int128 edge = Int128{coordinate} * side_um;
  return static_cast<std::int64_t>(
      std::clamp<Int128>(edge, -10 * Int128{kMaxExtent_um}, 10 * Int128{kMaxExtent_um}));
}

// From `position` to the span [first, last]; 0 inside.
std::int64_t Gap(std::int64_t position, std::int64_t first, std::int64_t last) {
  return std::max({first - position, position - last, std::int64_t{0}});
}

Int128 SquaredSum(std::int64_t a, std::int64_t b) {
  return Int128{a} * a + Int128{b} * b;
}

}  // namespace

Result<RegionQuery> RegionQuery::Create(AtlasStore& store,
                                        const RegionRequest& request,
                                        Options options) {
  const std::uint32_t levels = store.identity().profile.levels;
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
  RegionQuery query(store, request, std::move(options));
  query.level_ = request.only_finest ? request.finest_level : coarsest;
  query.last_level_ = request.finest_level;
  return query;
}

RegionQuery::RegionQuery(AtlasStore& store, const RegionRequest& request, Options options)
    : store_(&store), request_(request), options_(std::move(options)) {
  if (request_.disc) {
    RegionDisc& disc = *request_.disc;
    disc.x_um = Clamped(disc.x_um);
    disc.y_um = Clamped(disc.y_um);
    disc.radius_um = std::min(disc.radius_um, static_cast<std::uint64_t>(kMaxExtent_um));
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
    auto tile = store_->ReadTile(*id);
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
  ATLAS_RETURN_IF_ERROR(store_->ScanTiles(Rect(), [&](const TileSummary& tile) {
    const auto candidate = ToCandidate(tile.id);
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
  const RegionDisc& disc = *request_.disc;
  const std::int64_t side = side_um();
  const std::int64_t min_x = Edge(id.x, side);
  const std::int64_t min_y = Edge(id.y, side);
  const Int128 gap =
      SquaredSum(Gap(disc.x_um, min_x, min_x + side), Gap(disc.y_um, min_y, min_y + side));
  const auto radius = static_cast<std::int64_t>(disc.radius_um);
  if (gap > Int128{radius} * radius) {
    return std::nullopt;
  }
  return Candidate{SquaredSum(min_x + side / 2 - disc.x_um, min_y + side / 2 - disc.y_um),
                   id.Key()};
}

std::int64_t RegionQuery::side_um() const {
  const MapProfile& profile = store_->identity().profile;
  return (std::int64_t{profile.cell_size_um} * profile.tile_cells) << level_;
}

TileRect RegionQuery::Rect() const {
  TileRect rect{static_cast<std::uint8_t>(level_)};
  if (request_.disc) {
    const RegionDisc& disc = *request_.disc;
    const auto radius = static_cast<std::int64_t>(disc.radius_um);
    rect.min_x = TileCoordinate(disc.x_um - radius, side_um());
    rect.min_y = TileCoordinate(disc.y_um - radius, side_um());
    rect.max_x = TileCoordinate(disc.x_um + radius, side_um());
    rect.max_y = TileCoordinate(disc.y_um + radius, side_um());
  }
  return rect;
}

}  // namespace atlas
