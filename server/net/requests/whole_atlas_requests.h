// Requests that wait for the workers or read the whole atlas. Each takes a place of those who may
// wait long (kUnavailable when there is none) and ends when its peer leaves.
#pragma once

#include <boost/asio/awaitable.hpp>

#include "server/net/requests/request.h"
#include "server/net/requests/request_context.h"
#include "server/net/requests/request_record.h"
#include "server/net/stream/reply_writer.h"

namespace atlas {

// Each sends its reply, or returns an error for the peer. All arguments outlive the call.

boost::asio::awaitable<Status> AnswerWait(RequestContext& context,
                                          const Request& request,
                                          RequestRecord& record,
                                          ReplyWriter& out);
boost::asio::awaitable<Status> AnswerDigest(RequestContext& context,
                                            const Request& request,
                                            ReplyWriter& out);
boost::asio::awaitable<Status> AnswerVerify(RequestContext& context,
                                            const Request& request,
                                            ReplyWriter& out);
boost::asio::awaitable<Status> AnswerCompact(RequestContext& context,
                                             const Request& request,
                                             ReplyWriter& out);

}  // namespace atlas
