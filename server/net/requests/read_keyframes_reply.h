// The reply to who reads a session's keyframes back: each as a frame with its blob, by rising
// sequence number, within the byte budget (docs/protocol.md).
#pragma once

#include <boost/asio/awaitable.hpp>

#include "proto/wire/envelope.h"
#include "server/net/requests/peer.h"
#include "server/net/requests/request_context.h"

namespace atlas {

// Sends every frame of the reply, KeyframesEnd last, or returns an error for the peer:
// kInvalidArgument on names that are none, or a budget too small for any reply; kNotFound. Larger
// keyframes than there is room for at a time take a place of those who read the whole atlas, one
// each until it has left: when there is none the reply ends before that keyframe, or is
// kUnavailable where it would be the first. All arguments outlive the call.
boost::asio::awaitable<Status> AnswerReadKeyframes(RequestContext& context,
                                                   const wire::Envelope& request,
                                                   Peer& peer);

}  // namespace atlas
