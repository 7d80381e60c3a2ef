// One request in, its replies out: the wire's side of every use case of AtlasService.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>

#include "proto/wire/envelope.h"
#include "server/net/access/access_control.h"
#include "server/net/net_options.h"
#include "server/net/requests/freed_memory.h"
#include "server/net/requests/large_requests.h"
#include "server/net/requests/peer.h"
#include "server/net/requests/request.h"
#include "server/net/requests/request_context.h"
#include "server/net/requests/request_conversion.h"
#include "server/net/requests/request_record.h"
#include "server/net/requests/sync_reply.h"
#include "server/net/requests/tile_frames.h"
#include "server/net/requests/watch_requests.h"
#include "server/net/requests/write_requests.h"
#include "server/net/stream/reply_writer.h"
#include "server/service/atlas_service.h"

namespace atlas {

// Shared by all connections and their threads. Where what may block runs, RequestContext says. All
// arguments outlive this.
class RequestHandler {
  using Envelope = wire::Envelope;

 public:
  RequestHandler(AtlasService& service,
                 boost::asio::thread_pool& pool,
                 FairPool& reply_pool,
                 FairPool& reading_pool,
                 const NetOptions& options)
      : context_{service,
                 pool,
                 reply_pool,
                 reading_pool,
                 WaitPlaces("waits", &PeerShare::waits, options.max_waits, 0),
                 WaitPlaces("digests, verifications and the like",
                            &PeerShare::works,
                            options.max_works,
                            options.max_works / 4)},
        options_(options),
        large_(freed_),
        watches_(service, large_, freed_, options),
        frames_(options.tile_frame_bytes) {}

  std::int64_t NowMs() const { return context_.service.NowMs(); }
  // Whether the first frame of a connection is a Hello for this atlas.
  Status CheckGreeting(const wire::Envelope& request) const {
    return CheckHello(request, context_.service.identity().profile);
  }
  // Its reply, of a peer that may come in; with a session to be resumed it is to be awaited.
  std::optional<boost::asio::awaitable<void>> Greet(wire::Envelope request,
                                                    const Identity& identity,
                                                    ReplyWriter& out);
  // Every later one, which gets its replies, or one error. What can be answered from memory is, at
  // once; else the rest is to be awaited.
  std::optional<boost::asio::awaitable<void>> Handle(Request request, Peer& peer);
  // Of one that is refused before it is handled: what comes behind it may have to wait for it.
  static void NoteDenied(const Envelope& request, const Status& denied, Peer& peer) {
    if (request.has_upload_keyframe()) {
      NoteRefusedUpload(request.upload_keyframe(), denied, peer);
    }
  }
  // Those of frames that are large; to be handled as any other then.
  boost::asio::awaitable<Result<LargeRequests::Outcome>> ReadLarge(LargeFrame frame,
                                                                   const Identity& identity) {
    return large_.Read(std::move(frame), identity);
  }
  // Waits for those that are being read; to be called before the connections' threads are gone.
  void Join() { large_.Join(); }
  // What requests left behind goes back to the system, if that is much. To be called now and then.
  void ReturnFreed(FreedMemory::Clock::time_point now);

 private:
  boost::asio::awaitable<void> Await(Request request, Peer& peer);
  boost::asio::awaitable<void> Resume(SessionKey session,
                                      Envelope reply,
                                      RequestRecord record,
                                      ReplyWriter& out);
  static void Cancel(const Envelope& request, Peer& peer);
  boost::asio::awaitable<Status> Dispatch(const Request& whole, RequestRecord& record, Peer& peer);
  static boost::asio::awaitable<Status> Refuse(const Envelope& request);
  // False: what is left takes long, or the disk, or the peer does not take it.
  static bool SyncAtOnce(SyncReply& reply, RequestRecord& record, ReplyWriter& out);
  boost::asio::awaitable<void> Sync(std::shared_ptr<SyncReply> reply,
                                    SyncHold hold,
                                    RequestRecord record,
                                    std::unique_ptr<TurnOrder::Turn> turn,
                                    Peer& peer);
  // Without a turn it waits for the revision that it asks for first.
  boost::asio::awaitable<Status> WaitAndSync(std::shared_ptr<SyncReply> reply,
                                             SyncHold hold,
                                             std::unique_ptr<TurnOrder::Turn> turn,
                                             Peer& peer);

  RequestContext context_;
  const NetOptions& options_;
  FreedMemory freed_;
  LargeRequests large_;
  WatchRequests watches_;
  TileFrames frames_;
};

}  // namespace atlas
