#include "server/net/requests/region_reply.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

// Kept by a query that waits for its peer, from 16 to 512 KiB: the less, the more the others have.
constexpr std::size_t kLeastCandidates = 512;
constexpr std::size_t kMostCandidates = 16'384;
// More than any frame of a reply has besides its tile's blob.
constexpr std::size_t kFrameOverheadBytes = kFrameHeaderBytes + 52;

std::size_t TileCost(const StoredTile& tile) {
  return tile.blob.size() + kFrameOverheadBytes;
}

wire::Envelope TileEnvelope(std::uint64_t request_id, const StoredTile& tile) {
  wire::Envelope envelope;
  envelope.set_request_id(request_id);
  wire::TileMessage& message = *envelope.mutable_tile();
  message.set_key(tile.id.Key());
  message.set_revision(tile.revision);
  message.set_payload_hash(tile.payload_hash);
  message.set_blob(BytesToWire(tile.blob));
  return envelope;
}

struct TileBatch {
  std::vector<StoredTile> tiles;
  bool is_last = false;
};

// Tiles of `max_bytes` and up to one more.
Result<TileBatch> NextBatch(AtlasService& service, RegionQuery& query, std::size_t max_bytes) {
  TileBatch batch;
  std::size_t bytes = 0;
  do {
    Result<std::optional<StoredTile>> tile = service.NextTile(query);
    if (!tile) {
      return Error(tile.error());
    }
    batch.is_last = !*tile;
    if (*tile) {
      bytes += TileCost(**tile);
      batch.tiles.push_back(std::move(**tile));
    }
  } while (!batch.is_last && bytes < max_bytes);
  return batch;
}

// A query under way, and the revision that its end will name.
struct Cursor {
  RegionQuery query;
  std::uint64_t revision = 0;
};

Result<std::shared_ptr<Cursor>> OpenCursor(AtlasService& service,
                                           const RegionRequest& region,
                                           const Patience& patience) {
  const std::uint64_t current = service.revision();
  RegionQuery::Options options;
  options.max_candidates = kMostCandidates;
  options.end_bytes = kFrameOverheadBytes;
  options.tile_cost = &TileCost;
  Result<RegionQuery> query = service.Query(region, std::move(options), patience);
  if (!query) {
    return Error(query.error());
  }
  return std::make_shared<Cursor>(Cursor{std::move(*query), region.at_revision.value_or(current)});
}

struct Sent {
  std::uint32_t tiles = 0;
  std::uint64_t bytes = 0;
};

// What has room already.
Status SendBatch(std::uint64_t request_id, const TileBatch& batch, Sent& sent, ReplyWriter& out) {
  for (const StoredTile& tile : batch.tiles) {
    Result<Bytes> bytes = EncodeEnvelopeFrame(TileEnvelope(request_id, tile));
    if (!bytes) {
      return bytes.error();
    }
    ++sent.tiles;
    sent.bytes += bytes->size();
    out.Push(ReplyFrame(*std::move(bytes)));
  }
  out.Flush();
  return {};
}

// The end counts itself: its own length depends on the number it carries.
Result<Bytes> EndFrame(std::uint64_t request_id,
                       const Sent& sent,
                       bool is_truncated,
                       std::uint64_t revision) {
  wire::Envelope envelope;
  envelope.set_request_id(request_id);
  wire::QueryEnd& end = *envelope.mutable_query_end();
  end.set_tiles(sent.tiles);
  end.set_revision(revision);
  end.set_truncated(is_truncated);
  end.set_bytes(sent.bytes);
  for (int pass = 0; pass < 2; ++pass) {
    end.set_bytes(sent.bytes + kFrameHeaderBytes + envelope.ByteSizeLong());
  }
  return EncodeEnvelopeFrame(envelope);
}

}  // namespace

Result<RegionRequest> RegionFromWire(const wire::QueryRegion& query) {
  if (query.sections_size() != 0) {
    return Error(StatusCode::kUnsupported,
                 "query: tiles come whole, sections cannot be chosen yet");
  }
  RegionRequest region;
  if (query.has_disc()) {
    region.disc = RegionDisc{query.disc().x_um(), query.disc().y_um(), query.disc().radius_um()};
  }
  region.finest_level = query.finest_level();
  region.coarsest_level = query.coarsest_level();
  region.only_finest = query.only_finest();
  region.budget_bytes = query.budget_bytes();
  if (query.has_at_revision()) {
    region.at_revision = query.at_revision();
  }
  return region;
}

asio::awaitable<Status> SendRegion(AtlasService& service,
                                   FairPool& pool,
                                   const wire::Envelope& request,
                                   RegionRequest region,
                                   std::optional<Patience> patience,
                                   ReplyWriter& out) {
  // Tiles of the past are fused one by one: each is sent when it is there, and nobody who has his
  // at once waits for its room meanwhile.
  const std::size_t batch_bytes = region.at_revision ? 0 : kReplyBatchBytes;
  const std::uint64_t request_id = request.request_id();
  const FairPool::Whose whose = out.peer().whose();
  const FairPool::Deadline deadline =
      patience ? FairPool::Deadline(patience->deadline) : std::nullopt;
  const Blocking<std::shared_ptr<Cursor>> open = [&service, region, patience] {
    return OpenCursor(service, region, patience.value_or(Patience()));
  };
  const Result<std::shared_ptr<Cursor>> opened = co_await pool.Run(whose, deadline, open);
  if (!opened) {
    co_return opened.error();
  }
  const std::shared_ptr<Cursor>& cursor = *opened;
  Sent sent;
  ReplyWriter::Kept kept(out);
  for (bool is_last = false; !is_last;) {
    const ReplyWriter::Room room = co_await out.TakeRoom(batch_bytes);
    if (!room) {
      co_return ReplyWriter::Room::Gone();
    }
    if (!region.at_revision) {  // those are few, and looking for candidates again takes them long
      const std::size_t candidates = std::clamp(out.share_bytes() / RegionQuery::kCandidateBytes,
                                                kLeastCandidates, kMostCandidates);
      cursor->query.set_max_candidates(candidates);
      kept.Set(cursor->query.kept_bytes() + candidates * RegionQuery::kCandidateBytes);
    }
    const Blocking<TileBatch> read = [&service, cursor, bytes = room.bytes()] {
      return NextBatch(service, cursor->query, bytes);
    };
    const Result<TileBatch> batch = co_await pool.Run(whose, deadline, read);
    if (!batch) {
      co_return batch.error();
    }
    if (Status status = SendBatch(request_id, *batch, sent, out); !status.ok()) {
      co_return status;
    }
    is_last = batch->is_last;
    kept.Set(cursor->query.kept_bytes());
  }
  Result<Bytes> end = EndFrame(request_id, sent, cursor->query.is_truncated(), cursor->revision);
  if (!end) {
    co_return end.error();
  }
  out.Push(ReplyFrame(*std::move(end)));
  out.Flush();
  co_return Status();
}

}  // namespace atlas
