// One peer as its requests see it. For the thread of its connection.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <stop_token>
#include <utility>

#include "server/net/byte_budget.h"
#include "server/net/requests/turn_order.h"
#include "server/net/stream/reply_writer.h"
#include "server/service/upload_check.h"

namespace atlas {

class Peer {
 public:
  // `writer` outlives this; all on `executor`.
  Peer(ReplyWriter& writer,
       const boost::asio::any_io_executor& executor,
       std::size_t max_watched_bytes)
      : out(writer), uploads(executor), streams(executor), watched(max_watched_bytes) {}

  // Fewer than a connection may have requests in flight: a peer can always say "cancel".
  static constexpr std::size_t kMaxCancellable = 16;

  // A request that goes on until it is cancelled. False: there are too many, or one under that id.
  bool Begin(std::uint64_t request_id) {
    return cancellable_.size() < kMaxCancellable && cancellable_.try_emplace(request_id).second;
  }
  std::stop_token cancelled(std::uint64_t request_id) {
    return cancellable_.at(request_id).get_token();
  }
  void End(std::uint64_t request_id) { cancellable_.erase(request_id); }
  // False: there is none under that id.
  bool Cancel(std::uint64_t request_id) {
    const auto found = cancellable_.find(request_id);
    return found != cancellable_.end() && found->second.request_stop();
  }

  ReplyWriter& out;
  // Checked side by side, they reach the store in the order in which they came, so that the last
  // sequence number that is there tells what else is.
  TurnOrder uploads;
  // Replies of many frames are made one after the other: what one keeps meanwhile is kept once.
  TurnOrder streams;
  ByteBudget watched;  // areas that its watches keep
  const std::shared_ptr<MissingUploads> missing = std::make_shared<MissingUploads>();

 private:
  std::map<std::uint64_t, std::stop_source> cancellable_;
};

}  // namespace atlas
