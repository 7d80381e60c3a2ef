// Requests that change the atlas: answered once the change is on disk, or refused.
#pragma once

#include <boost/asio/awaitable.hpp>

#include "proto/wire/envelope.h"
#include "server/net/requests/peer.h"
#include "server/net/requests/request.h"
#include "server/net/requests/request_context.h"

namespace atlas {

// Each sends its reply, or returns an error for the peer. All arguments outlive the call.

// Keyframes of one connection reach the store in the order in which they came.
boost::asio::awaitable<Status> AnswerUpload(RequestContext& context,
                                            const wire::Envelope& request,
                                            Peer& peer);
// Of a keyframe that is refused, wherever that is: those behind it in its session may have to wait
// for it.
void NoteRefusedUpload(const wire::UploadKeyframe& message, const Status& why, Peer& peer);
boost::asio::awaitable<Status> AnswerUpdatePoses(RequestContext& context,
                                                 const Request& request,
                                                 ReplyWriter& out);
boost::asio::awaitable<Status> AnswerUndoPoses(RequestContext& context,
                                               const wire::Envelope& request,
                                               ReplyWriter& out);
boost::asio::awaitable<Status> AnswerChangeSession(RequestContext& context,
                                                   const wire::Envelope& request,
                                                   ReplyWriter& out);

}  // namespace atlas
