// A region query as a cursor: tiles coarse first, within a level nearest to the centre first, until
// the region or the byte budget ends. Pulled one tile at a time; holds no transaction in between
// and a bounded number of candidates, however large the region.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>

#include "core/base/integer_math.h"
#include "core/base/status.h"
#include "server/service/region/region_disc.h"
#include "server/service/region/tile_view.h"

namespace atlas {

struct RegionRequest {
  std::optional<RegionDisc> disc;  // none: the whole atlas, in key order
  std::uint32_t finest_level = 0;
  std::uint32_t coarsest_level = 0;  // 0: the atlas's coarsest
  bool only_finest = false;
  std::uint64_t budget_bytes = 0;                           // 0: none
  std::optional<std::uint64_t> at_revision = std::nullopt;  // none: the atlas as it is
};

class RegionQuery {
 public:
  struct Options {
    std::size_t max_candidates = 65'536;  // kept at a time; more are looked for again
    std::size_t end_bytes = 64;           // set aside of the budget for the reply's last frame
    // What a tile costs of the budget: its frame's size.
    std::function<std::size_t(const StoredTile&)> tile_cost;
  };

  // kInvalidArgument on levels that the atlas has not or a budget too small for any reply.
  static Result<RegionQuery> Create(std::shared_ptr<TileView> tiles,
                                    const RegionRequest& request,
                                    Options options);

  // The next tile; nullopt when there is none or the next one does not fit. kInvalidData names a
  // damaged tile.
  Result<std::optional<StoredTile>> Next();

  bool is_truncated() const { return is_truncated_; }
  bool is_of_the_past() const { return request_.at_revision.has_value(); }
  const std::optional<TileId>& last_tried() const { return last_tried_; }
  // From the next ones on that are looked for.
  void set_max_candidates(std::size_t count) { options_.max_candidates = count; }
  // Of candidates that are kept until it goes on.
  std::size_t kept_bytes() const { return candidates_.size() * kCandidateBytes; }
  static constexpr std::size_t kCandidateBytes = 32;

 private:
  // Order within a level: squared distance of the tile's centre, then key.
  struct Candidate {
    Int128 distance = 0;
    std::uint64_t key = 0;

    // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 sees a null pointer in <=>
    friend auto operator<=>(const Candidate&, const Candidate&) = default;
  };

  static_assert(sizeof(Candidate) == kCandidateBytes);

  RegionQuery(std::shared_ptr<TileView> tiles, const RegionRequest& request, Options options);
  bool NextLevel();
  Status FillCandidates();
  std::optional<Candidate> ToCandidate(const TileId& id) const;
  Result<std::optional<StoredTile>> Take(StoredTile tile);
  TileRect Rect() const;

  std::shared_ptr<TileView> tiles_;
  RegionRequest request_;
  Options options_;
  std::uint32_t level_ = 0;
  std::uint32_t last_level_ = 0;
  std::deque<Candidate> candidates_;
  std::optional<Candidate> last_;  // where the next fill goes on
  bool is_level_listed_ = false;
  std::uint64_t used_bytes_ = 0;
  bool is_truncated_ = false;
  std::optional<TileId> last_tried_;
};

}  // namespace atlas
