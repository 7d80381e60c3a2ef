// A watch under way (docs/protocol.md, "Watch"): what changes in an area, as it is told on a
// connection that is used for other requests meanwhile. What nobody fetches becomes one, so that
// memory does not grow with it. One thread, the client's.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "core/base/status.h"
#include "core/geometry/map_area.h"
#include "core/geometry/tile_id.h"

namespace atlas {

class RpcChannel;

struct WatchQuery {
  MapArea area;
  std::uint8_t finest_level = 0;
  std::uint8_t coarsest_level = 0;  // 0: the atlas's
  // Between two events; the daemon takes 50 ms for less and a minute for more.
  std::chrono::milliseconds interval{0};
};

// Since the changes before, each tile once, as it is now. More than kMaxTold become is_anything.
struct AreaChanges {
  static constexpr std::size_t kMaxTold = 1'024;

  std::uint64_t revision = 0;               // the atlas's
  std::map<TileId, std::uint64_t> changed;  // with their revisions
  std::set<TileId> removed;
  std::set<TileId> below;    // under these some finer tiles changed
  bool is_anything = false;  // look at the whole area

  bool empty() const { return !is_anything && changed.empty() && removed.empty() && below.empty(); }
  void Add(const AreaChanges& later);
};

class AtlasWatch {
 public:
  using Clock = std::chrono::steady_clock;

  AtlasWatch(const AtlasWatch&) = delete;
  AtlasWatch& operator=(const AtlasWatch&) = delete;
  AtlasWatch(AtlasWatch&&) noexcept;
  AtlasWatch& operator=(AtlasWatch&&) noexcept;
  // Cancels it, without a wait. The connection goes on.
  ~AtlasWatch();

  // What was told since the last call; nullopt when nothing was within `timeout`. The first changes
  // are empty: from their revision on everything is told. Silence is no failure, however long. What
  // the daemon ended the watch with is returned then and ever after (`end`): kUnavailable for too
  // many of them or when it stops, kResourceExhausted for too many tiles in areas, kInvalidArgument
  // for an area that makes no sense. Else the link's failures: a watch ends with its connection.
  Result<std::optional<AreaChanges>> Next(std::chrono::milliseconds timeout);
  // The revision from which on everything is told. None: the daemon has not said so yet.
  const std::optional<std::uint64_t>& since() const;
  // Ok: the daemon has not ended it.
  const Status& end() const;

 private:
  friend class AtlasClient;
  struct State;

  explicit AtlasWatch(std::shared_ptr<State> state);
  static Result<AtlasWatch> Begin(const std::shared_ptr<RpcChannel>& channel,
                                  const WatchQuery& query,
                                  Clock::time_point latest);

  std::shared_ptr<State> state_;  // null: moved from
};

}  // namespace atlas
