// Frames that connections say, whole and as they must be.
#pragma once

#include <string>

#include "proto/wire/envelope.h"

namespace atlas::testing {

// Request 1. An empty token: of nobody in particular.
inline Bytes HelloFrame(const std::string& token = {}) {
  wire::Envelope hello;
  hello.set_request_id(1);
  hello.mutable_hello()->set_protocol_major(kProtocolMajor);
  hello.mutable_hello()->set_client_name("serving_bench");
  hello.mutable_hello()->set_token(token);
  return EncodeEnvelopeFrame(hello).value();
}

inline Bytes StatusFrame(std::uint64_t request_id) {
  wire::Envelope request;
  request.set_request_id(request_id);
  request.mutable_status_request();
  return EncodeEnvelopeFrame(request).value();
}

// The whole atlas.
inline Bytes QueryFrame(std::uint64_t request_id) {
  wire::Envelope request;
  request.set_request_id(request_id);
  request.mutable_query_region();
  return EncodeEnvelopeFrame(request).value();
}

// The same of it to one who holds nothing.
inline Bytes SyncAllFrame(std::uint64_t request_id) {
  wire::Envelope request;
  request.set_request_id(request_id);
  request.mutable_sync_request()->mutable_area()->mutable_disc()->set_radius_um(10'000'000'000);
  return EncodeEnvelopeFrame(request).value();
}

}  // namespace atlas::testing
