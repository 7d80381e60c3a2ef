#include "server/net/region_reply.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"
#include "server/net/on_pool.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

constexpr std::size_t kTilesPerRead = 16;
constexpr std::uint64_t kEndFrameBytes = 96;  // no QueryEnd frame is longer

class Budget {
 public:
  explicit Budget(std::uint64_t bytes) : limit_(bytes) {}

  // Whether a frame fits with the end of the reply after it; counts it if so.
  bool Take(std::size_t frame_bytes) {
    if (limit_ != 0 && used_ + frame_bytes + kEndFrameBytes > limit_) {
      return false;
    }
    used_ += frame_bytes;
    return true;
  }
  std::uint64_t used() const { return used_; }

 private:
  std::uint64_t limit_;
  std::uint64_t used_ = 0;
};

using TileBatch = std::vector<std::optional<StoredTile>>;

wire::Envelope TileEnvelope(std::uint64_t request_id, StoredTile tile) {
  wire::Envelope envelope;
  envelope.set_request_id(request_id);
  wire::TileMessage& message = *envelope.mutable_tile();
  message.set_key(tile.id.Key());
  message.set_revision(tile.revision);
  message.set_payload_hash(tile.payload_hash);
  message.set_blob(BytesToWire(tile.blob));
  return envelope;
}

struct Sent {
  std::uint32_t tiles = 0;
  bool is_truncated = false;
};

// False when the connection is gone.
asio::awaitable<Result<bool>> SendBatch(
    std::uint64_t request_id, TileBatch batch, Budget& budget, Sent& sent, ReplyWriter& out) {
  for (std::optional<StoredTile>& tile : batch) {
    if (!tile) {
      continue;  // deleted since the reply was planned
    }
    Result<Bytes> frame = EncodeEnvelopeFrame(TileEnvelope(request_id, std::move(*tile)));
    if (!frame) {
      co_return Error(frame.error());
    }
    if (!budget.Take(frame->size())) {
      sent.is_truncated = true;
      co_return true;
    }
    if (!co_await out.Send(std::move(*frame))) {
      co_return false;
    }
    ++sent.tiles;
  }
  co_return true;
}

// The end counts itself: its own length depends on the number it carries.
Result<Bytes> EndFrame(std::uint64_t request_id,
                       const Sent& sent,
                       std::uint64_t used,
                       std::uint64_t revision) {
  wire::Envelope envelope;
  envelope.set_request_id(request_id);
  wire::QueryEnd& end = *envelope.mutable_query_end();
  end.set_tiles(sent.tiles);
  end.set_revision(revision);
  end.set_truncated(sent.is_truncated);
  end.set_bytes(used);
  for (int pass = 0; pass < 2; ++pass) {
    end.set_bytes(used + kFrameHeaderBytes + envelope.ByteSizeLong());
  }
  return EncodeEnvelopeFrame(envelope);
}

}  // namespace

Result<RegionRequest> RegionFromWire(const wire::QueryRegion& query, const MapProfile& profile) {
  RegionRequest region;
  const std::uint32_t top = profile.levels - 1u;
  if (query.finest_level() > top || query.coarsest_level() > top) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("query: level ", std::max(query.finest_level(), query.coarsest_level()),
                        ", this atlas has levels 0 to ", top));
  }
  if (query.budget_bytes() != 0 && query.budget_bytes() < 2 * kEndFrameBytes) {
    return Error(StatusCode::kInvalidArgument, StrCat("query: a budget of ", query.budget_bytes(),
                                                      " bytes, at least ", 2 * kEndFrameBytes));
  }
  if (query.sections_size() != 0) {
    return Error(StatusCode::kUnsupported,
                 "query: tiles come whole, sections cannot be chosen yet");
  }
  if (query.has_disc()) {
    region.disc =
        RegionRequest::Disc{query.disc().x_um(), query.disc().y_um(), query.disc().radius_um()};
  }
  region.finest_level = static_cast<std::uint8_t>(query.finest_level());
  region.is_only_finest = query.only_finest();
  if (query.coarsest_level() != 0) {
    region.coarsest_level = static_cast<std::uint8_t>(query.coarsest_level());
  }
  return region;
}

asio::awaitable<Status> SendRegion(AtlasService& service,
                                   asio::thread_pool& pool,
                                   const wire::Envelope& request,
                                   RegionRequest region,
                                   ReplyWriter& out) {
  const std::uint64_t request_id = request.request_id();
  const Blocking<DirtyState> read_state = [&service] {
    return service.ReadDirtyState();
  };
  const Result<DirtyState> state = co_await OnPool(pool, read_state);
  if (!state) {
    co_return state.error();
  }
  const Blocking<std::vector<TileSummary>> make_plan = [&service, region] {
    return service.PlanRegion(region);
  };
  const Result<std::vector<TileSummary>> plan = co_await OnPool(pool, make_plan);
  if (!plan) {
    co_return plan.error();
  }
  Budget budget(request.query_region().budget_bytes());
  Sent sent;
  for (std::size_t begin = 0; begin < plan->size() && !sent.is_truncated; begin += kTilesPerRead) {
    std::vector<TileId> ids;
    for (std::size_t i = begin; i < std::min(begin + kTilesPerRead, plan->size()); ++i) {
      ids.push_back((*plan)[i].id);
    }
    const Blocking<TileBatch> read = [&service, ids] {
      return service.ReadTiles(ids);
    };
    Result<TileBatch> batch = co_await OnPool(pool, read);
    if (!batch) {
      co_return batch.error();
    }
    const Result<bool> is_open =
        co_await SendBatch(request_id, std::move(*batch), budget, sent, out);
    if (!is_open) {
      co_return is_open.error();
    }
    if (!*is_open) {
      co_return Status();
    }
  }
  Result<Bytes> end = EndFrame(request_id, sent, budget.used(), state->revision);
  if (!end) {
    co_return end.error();
  }
  co_await out.Send(std::move(*end));
  co_return Status();
}

}  // namespace atlas
