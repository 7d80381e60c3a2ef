// The last step of most requests: the result as a reply, or its error.
#pragma once

#include <utility>

#include <boost/asio/awaitable.hpp>

#include "core/base/status.h"
#include "proto/wire/envelope.h"
#include "server/net/requests/request_conversion.h"
#include "server/net/stream/reply_writer.h"

namespace atlas {

// Sends the reply whose body `to_wire` fills. Returns the error of a result that is one: nothing
// has been sent then.
template <typename T, typename Body>
boost::asio::awaitable<Status> Answer(const wire::Envelope& request,
                                      const Result<T>& result,
                                      Body* (wire::Envelope::*body)(),
                                      void (*to_wire)(const T&, Body&),
                                      ReplyWriter& out) {
  if (!result) {
    co_return result.error();
  }
  wire::Envelope reply = ReplyTo(request);
  to_wire(*result, *(reply.*body)());
  co_await out.Send(std::move(reply));
  co_return Status();
}

}  // namespace atlas
