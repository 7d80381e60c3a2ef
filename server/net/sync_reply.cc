#include "server/net/sync_reply.h"

#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"
#include "server/net/atlas_wait.h"
#include "server/net/on_pool.h"
#include "server/net/request_conversion.h"
#include "server/net/sync_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using Clock = std::chrono::steady_clock;

// The first batch is there soon, the others are worth their manifest.
constexpr int kFirstTiles = 4;
constexpr int kTilesPerBatch = 32;
constexpr std::size_t kBatchBytes = 512u << 10;
// At most, in bytes of a reply: a manifest without its tiles, a tile in it, the end.
constexpr std::size_t kManifestBytes = kFrameHeaderBytes + 64;
constexpr std::size_t kAnnouncementBytes = 40;
constexpr std::size_t kEndBytes = kFrameHeaderBytes + 96;

class SyncReply {
 public:
  struct Batch {
    std::vector<Bytes> frames;
    bool is_last = false;
  };

  SyncReply(AtlasService& service, wire::Envelope request)
      : service_(service), envelope_(std::move(request)) {}

  // Blocks.
  Status Begin() {
    Result<SyncRequest> request = SyncFromWire(message(), profile());
    if (!request) {
      return request.error();
    }
    request_ = *std::move(request);
    if (message().timeout_ms() > 0) {
      deadline_ = Clock::now() + TimeoutFromWire(message().timeout_ms());
    }
    const Result<std::uint64_t> revision = service_.ReadRevision();
    if (!revision) {
      return revision.error();
    }
    last_ = request_->after.value_or(
        SyncCursor{*revision, std::numeric_limits<double>::infinity(), ~std::uint64_t{0}});
    ATLAS_RETURN_IF_ERROR(Plan());
    HoldingsToWire(plan_, holdings_);
    const std::uint64_t least = kManifestBytes + holdings_.ByteSizeLong() + kEndBytes;
    if (message().budget_bytes() != 0 && message().budget_bytes() < least) {
      return {StatusCode::kInvalidArgument,
              StrCat("sync: a budget of ", message().budget_bytes(),
                     " bytes, expected at least the ", least, " that it takes without any tile")};
    }
    return {};
  }

  // A manifest and the tiles that it announces. Blocks.
  Result<Batch> Next() {
    wire::Envelope manifest_envelope = ReplyTo(envelope_);
    wire::SyncManifest& manifest = *manifest_envelope.mutable_sync_manifest();
    const bool is_first = sent_bytes_ == 0;
    if (is_first) {
      manifest = std::move(holdings_);
    }
    std::uint64_t expected_bytes = sent_bytes_ + kManifestBytes + manifest.ByteSizeLong();
    std::vector<Bytes> tiles;
    std::optional<End> end;
    const auto max_tiles = static_cast<std::size_t>(is_first ? kFirstTiles : kTilesPerBatch);
    std::size_t tile_bytes = 0;
    while (!end && tiles.size() < max_tiles && tile_bytes < kBatchBytes) {
      const SyncItem* item = nullptr;
      if (Status status = NextItem(item); !status.ok()) {
        return Error(std::move(status));
      }
      if (item == nullptr) {
        end = End::kWhole;
        break;
      }
      if (deadline_ && Clock::now() >= *deadline_) {
        end = End::kCut;
        break;
      }
      Result<std::optional<StoredTile>> tile = ReadTile(*item);
      if (!tile) {
        return Error(tile.error());
      }
      if (*tile) {  // else it is gone by now, or damaged and will be built again
        Result<Bytes> frame = TileFrame(**tile);
        if (!frame) {
          return Error(frame.error());
        }
        expected_bytes += frame->size() + kAnnouncementBytes;
        if (message().budget_bytes() != 0 &&
            expected_bytes + kEndBytes > message().budget_bytes()) {
          end = End::kCut;
          break;
        }
        AnnounceTile(**tile, (*tile)->blob.size(), profile(), manifest);
        tile_bytes += frame->size();
        tiles.push_back(*std::move(frame));
      }
      last_.priority = item->priority;
      last_.key = item->tile.id.Key();
      ++next_;
    }
    return MakeBatch(manifest_envelope, std::move(tiles), is_first, end);
  }

 private:
  enum class End { kWhole, kCut };

  const wire::SyncRequest& message() const { return envelope_.sync_request(); }
  const MapProfile& profile() const { return service_.identity().profile; }

  Status Plan() {
    auto plan = service_.PlanSync(*request_, true);
    if (!plan) {
      return plan.error();
    }
    plan_ = **std::move(plan);
    next_ = 0;
    return {};
  }

  // Null at the end.
  Status NextItem(const SyncItem*& item) {
    if (next_ == plan_.items.size() && plan_.is_cut) {
      request_->after = last_;
      ATLAS_RETURN_IF_ERROR(Plan());
    }
    item = next_ < plan_.items.size() ? &plan_.items[next_] : nullptr;
    return {};
  }

  // With the sections that are to be sent.
  Result<std::optional<StoredTile>> ReadTile(const SyncItem& item) {
    Result<std::optional<StoredTile>> tile = service_.ReadTile(item.tile.id);
    if (!tile && tile.error().code() == StatusCode::kInvalidData) {
      return std::nullopt;
    }
    if (!tile || !*tile) {
      return tile;
    }
    // Of other content than was planned nothing is held.
    const SectionMask sections =
        (*tile)->payload_hash == item.tile.payload_hash ? item.sections : request_->sections;
    if (sections != kAllSections) {
      Result<Bytes> blob = SelectSections((*tile)->blob, sections);
      if (!blob) {
        return Error(blob.error());
      }
      (*tile)->blob = *std::move(blob);
    }
    return tile;
  }

  Result<Bytes> TileFrame(const StoredTile& tile) const {
    wire::Envelope envelope = ReplyTo(envelope_);
    wire::TileMessage& out = *envelope.mutable_tile();
    out.set_key(tile.id.Key());
    out.set_revision(tile.revision);
    out.set_payload_hash(tile.payload_hash);
    out.set_blob(BytesToWire(tile.blob));
    return EncodeEnvelopeFrame(envelope);
  }

  Result<Batch> MakeBatch(const wire::Envelope& manifest,
                          std::vector<Bytes> tiles,
                          bool is_first,
                          std::optional<End> end) {
    Batch batch;
    batch.is_last = end.has_value();
    if (is_first || !tiles.empty()) {
      Result<Bytes> frame = EncodeEnvelopeFrame(manifest);
      if (!frame) {
        return Error(frame.error());
      }
      batch.frames.push_back(*std::move(frame));
    }
    sent_tiles_ += static_cast<std::uint32_t>(tiles.size());
    for (Bytes& frame : tiles) {
      batch.frames.push_back(std::move(frame));
    }
    for (const Bytes& frame : batch.frames) {
      sent_bytes_ += frame.size();
    }
    if (end) {
      Result<Bytes> frame = EndFrame(*end);
      if (!frame) {
        return Error(frame.error());
      }
      batch.frames.push_back(*std::move(frame));
    }
    return batch;
  }

  // The end counts itself: its own length depends on the number it carries.
  Result<Bytes> EndFrame(End how) const {
    wire::Envelope envelope = ReplyTo(envelope_);
    wire::SyncEnd& end = *envelope.mutable_sync_end();
    end.set_tiles(sent_tiles_);
    end.set_revision(last_.revision);
    if (how == End::kCut) {
      end.set_cursor(CursorToWire(last_, message()));
    }
    end.set_bytes(sent_bytes_);
    for (int pass = 0; pass < 2; ++pass) {
      end.set_bytes(sent_bytes_ + kFrameHeaderBytes + envelope.ByteSizeLong());
    }
    return EncodeEnvelopeFrame(envelope);
  }

  AtlasService& service_;
  wire::Envelope envelope_;
  std::optional<SyncRequest> request_;
  std::optional<Clock::time_point> deadline_;
  SyncPlan plan_;
  std::size_t next_ = 0;  // item of the plan
  SyncCursor last_;       // of the items so far
  wire::SyncManifest holdings_;
  std::uint32_t sent_tiles_ = 0;
  std::uint64_t sent_bytes_ = 0;
};

}  // namespace

asio::awaitable<Status> SendSync(AtlasService& service,
                                 asio::thread_pool& pool,
                                 wire::Envelope request,
                                 ReplyWriter& out) {
  const wire::SyncRequest& message = request.sync_request();
  if (message.wait_revision() != 0) {
    const Patience patience{TimeoutFromWire(message.timeout_ms()), out.peer_left()};
    Status status = co_await WaitForRevision(service, pool, message.wait_revision(), patience);
    if (!status.ok()) {
      co_return status;
    }
  }
  const auto reply = std::make_shared<SyncReply>(service, std::move(request));
  const Blocking<bool> begin = [reply]() -> Result<bool> {
    Status status = reply->Begin();
    return status.ok() ? Result<bool>(true) : Error(std::move(status));
  };
  const Result<bool> has_begun = co_await OnPool(pool, begin);
  if (!has_begun) {
    co_return has_begun.error();
  }
  const Blocking<SyncReply::Batch> next = [reply] {
    return reply->Next();
  };
  while (true) {
    Result<SyncReply::Batch> batch = co_await OnPool(pool, next);
    if (!batch) {
      co_return batch.error();
    }
    for (Bytes& frame : batch->frames) {
      if (!co_await out.Send(std::move(frame))) {
        co_return Status();
      }
    }
    if (batch->is_last) {
      co_return Status();
    }
  }
}

}  // namespace atlas
