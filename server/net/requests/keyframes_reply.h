// The reply to a request for a session's keyframes: a page of them (docs/protocol.md).
#pragma once

#include <cstdint>

#include <boost/asio/awaitable.hpp>

#include "proto/wire/envelope.h"
#include "server/net/requests/peer.h"
#include "server/net/requests/request_context.h"

namespace atlas {

// Of a page, however much is asked for.
inline constexpr std::uint32_t kMaxKeyframesOfPage = 2'000;

// Sends the page, as large as there is room for replies, or returns an error for the peer:
// kInvalidArgument on names that are none, kNotFound. All arguments outlive the call.
boost::asio::awaitable<Status> AnswerKeyframes(RequestContext& context,
                                               const wire::Envelope& request,
                                               Peer& peer);

}  // namespace atlas
