// Backups: a reply now and then as long as one is written, and one when it is.
#pragma once

#include <boost/asio/awaitable.hpp>

#include "server/net/requests/request.h"
#include "server/net/requests/request_context.h"
#include "server/net/stream/reply_writer.h"

namespace atlas {

// Sends its replies, or returns an error for the peer, whose leaving ends it. Takes a place of
// those who may wait long. All arguments outlive the call.
boost::asio::awaitable<Status> AnswerBackup(RequestContext& context,
                                            const Request& whole,
                                            ReplyWriter& out);

}  // namespace atlas
