// The reply to a sync: manifests, tiles and the end, within its budget (docs/protocol.md, "Sync").
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>

#include "proto/wire/envelope.h"
#include "server/net/requests/reply_tiles.h"
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

  // Its time runs from now on. `is_large`: every step takes long. `service` and `frames` outlive
  // this.
  SyncReply(AtlasService& service,
            TileFrames& frames,
            std::shared_ptr<const wire::Envelope> request,
            bool is_large = false);

  const wire::SyncRequest& message() const { return envelope_->sync_request(); }
  std::uint64_t request_id() const { return envelope_->request_id(); }

  // Appends the next frames, tiles of `max_bytes` and up to one more. An error ends the reply;
  // kInvalidArgument: a request that makes no sense.
  Result<Step> Next(bool may_block,
                    std::vector<ReplyFrame>& out,
                    std::size_t max_bytes = kReplyBatchBytes);

 private:
  using Clock = std::chrono::steady_clock;
  using Body = ReplyTiles::Body;
  enum class End { kWhole, kCut };
  struct Batch {
    wire::Envelope manifest;
    std::vector<Body> tiles;
    std::size_t tile_bytes = 0;
    std::optional<End> end;
  };

  Result<Step> Begin(bool may_block);
  Result<Step> Plan(bool may_block);
  Result<Step> Fill(bool may_block, std::size_t max_bytes, Batch& batch);
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
  const std::shared_ptr<const wire::Envelope> envelope_;
  const bool is_large_;
  std::optional<SyncRequest> request_;  // from Begin() on
  std::optional<Clock::time_point> deadline_;
  SyncPlan plan_;
  std::size_t next_ = 0;  // item of the plan
  SyncCursor last_;       // of the items so far
  wire::SyncManifest holdings_;
  bool has_begun_ = false;
  bool is_for_pool_ = false;  // the plan takes the disk, or long: known from trying
  std::uint32_t sent_tiles_ = 0;
  std::uint64_t sent_bytes_ = 0;
};

// What is left of it. What takes long, or the disk, runs on `pool`.
boost::asio::awaitable<Status> SendSync(std::shared_ptr<SyncReply> reply,
                                        boost::asio::thread_pool& pool,
                                        ReplyWriter& out);

}  // namespace atlas
