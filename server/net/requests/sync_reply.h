// The reply to a sync: manifests, tiles and the end, within its budget (docs/protocol.md, "Sync").
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <boost/asio/awaitable.hpp>

#include "proto/wire/envelope.h"
#include "server/net/requests/fair_pool.h"
#include "server/net/requests/reply_tiles.h"
#include "server/net/requests/request.h"
#include "server/net/stream/reply_writer.h"
#include "server/service/atlas_service.h"

namespace atlas {

// Step by step. Whoever may not block gets what there is in memory.
class SyncReply {
 public:
  enum class Step {
    kMore,
    kDone,
    kBlocked,  // nothing was done: the next frames take the disk, or long
  };

  using Clock = std::chrono::steady_clock;

  // Of the next frames: tiles of so many bytes and up to one more, and of the plan for them.
  struct Room {
    std::size_t bytes = kReplyBatchBytes;
    std::size_t plan_bytes = kMaxPlanBytes;
  };
  static constexpr std::size_t kMaxPlanBytes = SyncLimits().max_items * sizeof(SyncItem);

  // Its time runs from when it was read. Of a large request every step takes long. `service` and
  // `frames` outlive this.
  SyncReply(AtlasService& service, TileFrames& frames, const Request& request);

  const wire::SyncRequest& message() const { return envelope_->sync_request(); }
  std::uint64_t request_id() const { return envelope_->request_id(); }
  const std::optional<Clock::time_point>& deadline() const { return deadline_; }
  // Some of it was sent: it can be cut where it is.
  bool has_begun() const { return sent_bytes_ > 0; }
  // Its time was over before all was sent.
  bool is_cut_late() const { return is_cut_late_; }

  // What it keeps until it goes on.
  std::size_t kept_bytes() const { return plan_.item_bytes(); }
  // What was asked is still there, and takes more than a small request does.
  bool is_held() const {
    return !has_planned_ || request_->held.bytes() + request_->area.bytes() > kSmallBytes;
  }

  // Appends the next frames; the first one of all is as large as what is held makes it. An error
  // ends the reply; kInvalidArgument: a request that makes no sense.
  Result<Step> Next(bool may_block, std::vector<ReplyFrame>& out, const Room& room);
  Result<Step> Next(bool may_block, std::vector<ReplyFrame>& out) {
    return Next(may_block, out, Room());
  }

 private:
  static constexpr std::size_t kSmallBytes = 16u << 10;
  using Body = ReplyTiles::Body;
  enum class End { kWhole, kCut };
  struct Batch {
    explicit Batch(wire::Envelope& reply) : manifest(reply) {}

    wire::Envelope& manifest;
    std::vector<Body> tiles;
    std::size_t tile_bytes = 0;
    std::optional<End> end;
  };

  Status TakeOrder();
  Result<Step> Begin(bool may_block, const Room& room);
  Result<Step> Plan(bool may_block, const Room& room);
  Result<Step> Fill(bool may_block, const Room& room, Batch& batch);
  Status Emit(const Batch& batch, std::vector<ReplyFrame>& out);
  // The end counts itself: its own length depends on the number it carries.
  Result<Bytes> EndFrame(End how) const;
  bool IsLate() const { return deadline_ && Clock::now() >= *deadline_; }
  bool Fits(std::uint64_t bytes) const {
    return message().budget_bytes() == 0 || bytes <= message().budget_bytes();
  }
  const MapProfile& profile() const { return service_.identity().profile; }

  AtlasService& service_;
  ReplyTiles tiles_;
  const std::shared_ptr<wire::Envelope> envelope_;
  const bool is_large_;
  std::optional<SyncRequest> request_;  // from Begin() on
  std::optional<Clock::time_point> deadline_;
  SyncPlan plan_;
  std::size_t next_ = 0;         // item of the plan
  SyncCursor last_;              // of the items so far
  wire::SyncManifest holdings_;  // until they are told
  bool has_planned_ = false;
  bool is_for_pool_ = false;  // the plan takes the disk, or long: known from trying
  bool is_cut_late_ = false;
  std::uint32_t sent_tiles_ = 0;
  std::uint64_t sent_bytes_ = 0;
};

// What the daemon holds for a request: `request` until all that it holds has been looked at,
// `reply` until the peer has taken what became of that.
struct SyncHold {
  std::shared_ptr<const void> request;
  std::shared_ptr<const void> reply;
};

// What is left of it. What takes long, or the disk, runs on `pool`; kTimeout: its time was over
// before that had begun.
boost::asio::awaitable<Status> SendSync(std::shared_ptr<SyncReply> reply,
                                        SyncHold hold,
                                        FairPool& pool,
                                        ReplyWriter& out);

}  // namespace atlas
