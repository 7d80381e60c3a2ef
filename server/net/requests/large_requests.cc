#include "server/net/requests/large_requests.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <boost/asio/post.hpp>

#include "server/base/thread_priority.h"
#include "server/net/access/access_check.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/request_conversion.h"
#include "server/net/requests/sync_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

// What smaller ones leave free is used by the next ones.
constexpr std::size_t kNotedBytes = 1u << 20;
constexpr std::size_t kNeverMuchBytes = 512;  // of a frame: 40 KB at most
constexpr std::size_t kUsualUnfolding = 8;    // poses with names
// Of nice(1), behind threads that answer small ones: a third of what they get of a busy core.
constexpr int kYield = 5;

std::size_t BytesOf(const Result<PoseBatchRequest>& poses) {
  std::size_t bytes = 0;
  if (poses) {
    for (const PoseBatchRequest::Update& update : poses->updates) {
      const SessionKey& session = update.key.session;
      bytes += sizeof(update) + session.vehicle.size() + session.session.size();
    }
    for (const SessionKey& session : poses->published) {
      bytes += sizeof(session) + session.vehicle.size() + session.session.size();
    }
  }
  return bytes;
}

}  // namespace

std::size_t UnfoldedBytes(const wire::Envelope& request, std::size_t frame_bytes) {
  if (frame_bytes < kNeverMuchBytes || request.has_upload_keyframe()) {
    return 0;
  }
  const std::size_t bytes = request.SpaceUsedLong();
  return bytes > kUsualUnfolding * frame_bytes ? bytes : 0;
}

LargeRequests::LargeRequests(FreedMemory& freed) : freed_(freed) {
  asio::post(pool_, [] { YieldToOthers(kYield); });
}

asio::awaitable<Result<LargeRequests::Outcome>> LargeRequests::Read(LargeFrame frame,
                                                                    Identity identity) {
  const auto began = std::chrono::steady_clock::now();
  const auto owned = std::make_shared<LargeFrame>(std::move(frame));
  const Blocking<Outcome> read = [this, owned, identity] {
    const LargeFrame gone_at_the_end = std::move(*owned);
    return ReadNow(gone_at_the_end, identity);
  };
  Result<Outcome> outcome = co_await OnPool(pool_, read);
  if (outcome) {
    outcome->request.began = began;
  }
  co_return outcome;
}

Result<LargeRequests::Outcome> LargeRequests::ReadNow(const LargeFrame& frame,
                                                      const Identity& identity) {
  const Result<ByteSpan> payload = frame.Payload();
  if (!payload) {
    return Error(payload.error());
  }
  Result<wire::Envelope> message = ParseEnvelope(*payload);
  if (!message) {
    return Error(message.error());
  }
  Outcome outcome;
  outcome.denied = CheckMayAsk(identity, *message);
  outcome.request.is_large = true;
  if (message->has_update_poses()) {
    wire::UpdatePoses& poses = *message->mutable_update_poses();
    outcome.request.poses = std::make_shared<Result<PoseBatchRequest>>(PosesFromWire(poses));
    poses = wire::UpdatePoses();  // several times as large as what was made of it
    outcome.bytes = BytesOf(*outcome.request.poses);
  }
  outcome.bytes += message->SpaceUsedLong();
  if (message->has_sync_request()) {
    const SyncBytes sync = BytesOf(message->sync_request());
    outcome.bytes = std::max(outcome.bytes, sync.request);
    outcome.reply_bytes = sync.first_manifest;
  }
  outcome.request.message = DestroyedHere(*std::move(message), frame.size());
  return outcome;
}

std::shared_ptr<wire::Envelope> LargeRequests::DestroyedHere(wire::Envelope message,
                                                             std::size_t frame_bytes) {
  const auto destroy = [this, frame_bytes](wire::Envelope* unused) {
    asio::post(pool_,
               [this, frame_bytes, owned = std::unique_ptr<wire::Envelope>(unused)]() mutable {
                 owned.reset();
                 freed_.Note(frame_bytes >= kNotedBytes ? frame_bytes : 0);
               });
  };
  return {new wire::Envelope(std::move(message)), destroy};
}

}  // namespace atlas
