#include "server/net/requests/sync_reply.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <utility>

#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <google/protobuf/arena.h>

#include "core/base/str_cat.h"
#include "server/net/requests/atlas_wait.h"
#include "server/net/requests/request_conversion.h"
#include "server/net/requests/sync_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

// The first batch is there soon, the others are worth their manifest.
constexpr std::size_t kFirstTiles = 4;
constexpr std::size_t kTilesPerBatch = 32;
// At most, in bytes of a reply: a manifest without its tiles, a tile in it, the end.
constexpr std::size_t kManifestBytes = kFrameHeaderBytes + 64;
constexpr std::size_t kAnnouncementBytes = 40;
constexpr std::size_t kEndBytes = kFrameHeaderBytes + 96;
constexpr std::size_t kTileFrameBytes = kFrameHeaderBytes + 11;  // besides its body
// Of a plan, however little room there is: 18 KiB. It is made again after these.
constexpr std::size_t kLeastItems = 256;

// For one message, most of which need no memory besides this.
class ReplyArena {
 public:
  wire::Envelope& NewReply(std::uint64_t request_id) {
    auto& reply = *google::protobuf::Arena::CreateMessage<wire::Envelope>(&arena_);
    reply.set_request_id(request_id);
    return reply;
  }

 private:
  alignas(std::max_align_t) std::array<char, 2'048> first_block_;
  google::protobuf::Arena arena_{first_block_.data(), first_block_.size()};
};

}  // namespace

SyncReply::SyncReply(AtlasService& service, TileFrames& frames, const Request& request)
    : service_(service),
      tiles_(service, frames),
      envelope_(request.message),
      is_large_(request.is_large) {
  if (message().timeout_ms() > 0) {
    deadline_ = request.began + TimeoutFromWire(message().timeout_ms());
  }
}

Result<SyncReply::Step> SyncReply::Next(bool may_block,
                                        std::vector<ReplyFrame>& out,
                                        const Room& room) {
  if (is_large_ && !may_block && !(has_begun() && IsLate())) {
    return Step::kBlocked;
  }
  if (!has_planned_) {
    Result<Step> begun = Begin(may_block, room);
    if (!begun || *begun == Step::kBlocked) {
      return begun;
    }
  }
  ReplyArena arena;
  Batch batch(arena.NewReply(request_id()));
  const bool is_first = sent_bytes_ == 0;
  if (is_first) {
    *batch.manifest.mutable_sync_manifest() = holdings_;
  }
  Result<Step> filled = Fill(may_block, room, batch);
  if (!filled) {
    return filled;
  }
  if (batch.tiles.empty() && !batch.end && *filled == Step::kBlocked) {
    return Step::kBlocked;
  }
  if (Status status = Emit(batch, out); !status.ok()) {
    return Error(std::move(status));
  }
  if (is_first) {
    holdings_ = wire::SyncManifest();
  }
  return batch.end ? Step::kDone : Step::kMore;
}

// What was asked for, without its message.
Status SyncReply::TakeOrder() {
  Result<SyncRequest> request = TakeSync(*envelope_->mutable_sync_request(), service_.identity());
  if (!request) {
    return request.error();
  }
  const std::uint64_t now = service_.revision();
  if (request->after && request->after->revision > now) {
    return {StatusCode::kInvalidArgument,
            StrCat("sync: the cursor is of revision ", request->after->revision,
                   " and the atlas at ", now, ", an earlier copy: ask without it")};
  }
  request_ = *std::move(request);
  last_ = request_->after.value_or(
      SyncCursor{now, std::numeric_limits<double>::infinity(), ~std::uint64_t{0}});
  return {};
}

Result<SyncReply::Step> SyncReply::Begin(bool may_block, const Room& room) {
  if (!request_) {
    if (Status status = TakeOrder(); !status.ok()) {
      return Error(std::move(status));
    }
  }
  Result<Step> planned = Plan(may_block, room);
  if (!planned || *planned == Step::kBlocked) {
    return planned;
  }
  HoldingsToWire(plan_, holdings_);
  plan_.DropHoldings();
  const std::uint64_t least = kManifestBytes + holdings_.ByteSizeLong() + kEndBytes;
  if (!Fits(least)) {
    return Error(
        StatusCode::kInvalidArgument,
        StrCat("sync: a budget of ", message().budget_bytes(), " bytes, expected at least the ",
               least, " that it takes without any tile"));
  }
  has_planned_ = true;
  return Step::kMore;
}

Result<SyncReply::Step> SyncReply::Plan(bool may_block, const Room& room) {
  if (is_for_pool_ && !may_block) {
    return Step::kBlocked;
  }
  const std::size_t items = std::max(kLeastItems, room.plan_bytes / sizeof(SyncItem));
  auto plan = service_.PlanSync(*request_, may_block, std::min(items, SyncLimits().max_items));
  if (!plan) {
    return Error(plan.error());
  }
  is_for_pool_ = !*plan;
  if (is_for_pool_) {
    return Step::kBlocked;
  }
  plan_ = **std::move(plan);
  next_ = 0;
  if (plan_.is_cut) {
    request_->held.KeepOnly(plan_.is_tile_seen, plan_.is_block_seen);
  } else {
    request_->held = HeldTiles();
  }
  return Step::kMore;
}

// With tiles, and the end, if that is reached.
Result<SyncReply::Step> SyncReply::Fill(bool may_block, const Room& room, Batch& batch) {
  wire::SyncManifest& manifest = *batch.manifest.mutable_sync_manifest();
  std::uint64_t bytes = sent_bytes_ + kManifestBytes + manifest.ByteSizeLong();
  const std::size_t max_tiles = sent_bytes_ == 0 ? kFirstTiles : kTilesPerBatch;
  // One tile in any case: a reply that makes no step would be asked for the next one for ever.
  while (batch.tiles.empty() || (batch.tiles.size() < max_tiles && batch.tile_bytes < room.bytes)) {
    if (IsLate() && (next_ < plan_.items.size() || plan_.is_cut)) {
      is_cut_late_ = true;
      batch.end = End::kCut;
      return Step::kDone;
    }
    if (next_ == plan_.items.size() && plan_.is_cut) {
      request_->after = last_;
      Result<Step> planned = Plan(may_block, room);
      if (!planned || *planned == Step::kBlocked) {
        return planned;
      }
      plan_.DropHoldings();
    }
    if (next_ == plan_.items.size()) {
      batch.end = End::kWhole;
      return Step::kDone;
    }
    const SyncItem& item = plan_.items[next_];
    Result<std::optional<Body>> found =
        tiles_.Find(*request_, item, message().takes_deltas(), may_block);
    if (!found) {
      return Error(found.error());
    }
    if (!*found) {
      return Step::kBlocked;
    }
    if (const Body body = **std::move(found)) {
      const std::size_t frame_bytes = kTileFrameBytes + body->bytes().size();
      bytes += frame_bytes + kAnnouncementBytes;
      if (!Fits(bytes + kEndBytes)) {
        batch.end = End::kCut;
        return Step::kDone;
      }
      AnnounceTile(*body, item.tile.id.level, profile(), manifest);
      batch.tile_bytes += frame_bytes;
      batch.tiles.push_back(body);
    }
    last_.priority = item.priority;
    last_.key = item.tile.id.Key();
    ++next_;
  }
  return Step::kMore;
}

Status SyncReply::Emit(const Batch& batch, std::vector<ReplyFrame>& out) {
  const std::size_t first = out.size();
  if (sent_bytes_ == 0 || !batch.tiles.empty()) {
    Result<Bytes> frame = EncodeEnvelopeFrame(batch.manifest);
    if (!frame) {
      return frame.error();
    }
    out.emplace_back(*std::move(frame));
  }
  for (const Body& tile : batch.tiles) {
    out.emplace_back(tile, request_id());
  }
  sent_tiles_ += static_cast<std::uint32_t>(batch.tiles.size());
  for (std::size_t i = first; i < out.size(); ++i) {
    sent_bytes_ += out[i].size();
  }
  if (batch.end) {
    Result<Bytes> frame = EndFrame(*batch.end);
    if (!frame) {
      return frame.error();
    }
    out.emplace_back(*std::move(frame));
  }
  return {};
}

Result<Bytes> SyncReply::EndFrame(End how) const {
  ReplyArena arena;
  wire::Envelope& envelope = arena.NewReply(request_id());
  wire::SyncEnd& end = *envelope.mutable_sync_end();
  end.set_tiles(sent_tiles_);
  end.set_revision(last_.revision);
  if (how == End::kCut) {
    end.set_cursor(CursorToWire(last_, *request_, service_.identity()));
  }
  end.set_bytes(sent_bytes_);
  for (int pass = 0; pass < 2; ++pass) {
    end.set_bytes(sent_bytes_ + kFrameHeaderBytes + envelope.ByteSizeLong());
  }
  return EncodeEnvelopeFrame(envelope);
}

asio::awaitable<Status> SendSync(std::shared_ptr<SyncReply> reply,
                                 SyncHold hold,
                                 FairPool& pool,
                                 ReplyWriter& out) {
  const auto executor = co_await asio::this_coro::executor;
  const auto frames = std::make_shared<std::vector<ReplyFrame>>();
  ReplyWriter::Kept kept(out);
  while (true) {
    kept.Set(reply->kept_bytes());
    const ReplyWriter::Room room = co_await out.TakeRoom(kReplyBatchBytes);
    if (!room) {
      co_return ReplyWriter::Room::Gone();
    }
    const SyncReply::Room next{room.bytes(), out.share_bytes()};
    Result<SyncReply::Step> step = reply->Next(false, *frames, next);
    if (step && *step == SyncReply::Step::kBlocked) {
      const Blocking<SyncReply::Step> read = [reply, frames, next] {
        return reply->Next(true, *frames, next);
      };
      kept.Set(reply->kept_bytes() + std::min(next.plan_bytes, SyncReply::kMaxPlanBytes));
      step = co_await pool.Run(out.peer().whose(), reply->deadline(), read);
      if (!step && step.error().code() == StatusCode::kTimeout && reply->has_begun()) {
        step = reply->Next(false, *frames, next);  // its end
      }
    }
    if (!step) {
      co_return step.error();
    }
    for (ReplyFrame& frame : *frames) {
      out.Push(std::move(frame), std::exchange(hold.reply, nullptr));
    }
    frames->clear();
    if (!reply->is_held()) {
      hold.request.reset();
    }
    out.Flush();
    if (*step == SyncReply::Step::kDone) {
      break;
    }
    co_await asio::post(executor, asio::use_awaitable);  // the others' turn
  }
  co_return Status();
}

}  // namespace atlas
