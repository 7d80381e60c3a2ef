// Requests that read a part of the atlas, or tell how it is.
#pragma once

#include <cstdint>

#include <boost/asio/awaitable.hpp>

#include "proto/wire/envelope.h"
#include "server/net/requests/peer.h"
#include "server/net/requests/request.h"
#include "server/net/requests/request_context.h"
#include "server/net/stream/reply_writer.h"

namespace atlas {

// Each sends its reply, or returns an error for the peer. All arguments outlive the call.

boost::asio::awaitable<Status> AnswerQuery(RequestContext& context,
                                           const Request& request,
                                           Peer& peer);
boost::asio::awaitable<Status> AnswerStatus(RequestContext& context,
                                            const wire::Envelope& request,
                                            ReplyWriter& out);
boost::asio::awaitable<Status> AnswerLog(RequestContext& context,
                                         const wire::Envelope& request,
                                         Peer& peer);
boost::asio::awaitable<Status> AnswerSessions(RequestContext& context,
                                              const wire::Envelope& request,
                                              Peer& peer);

// Until the tiles reflect `revision` (0: at once). If they do not yet it takes a place of those who
// wait: kUnavailable when there is none, kTimeout.
boost::asio::awaitable<Status> AwaitRevision(RequestContext& context,
                                             std::uint64_t revision,
                                             Patience patience,
                                             const ReplyWriter& out);

}  // namespace atlas
