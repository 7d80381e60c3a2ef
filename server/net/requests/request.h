// A request on its way through the daemon: its message, and what it counts for until it is dropped.
// Most are done with their message when they are answered; what lasts drops it before.
#pragma once

#include <chrono>
#include <memory>

#include "core/base/status.h"
#include "proto/wire/envelope.h"
#include "server/service/atlas_service.h"

namespace atlas {

struct Request {
  // Of a large one, the last of these has it destroyed on a thread for that.
  std::shared_ptr<wire::Envelope> message;
  // What its connection holds for it, given back with the last copy.
  std::shared_ptr<const void> held = nullptr;
  // Its last byte was there.
  std::chrono::steady_clock::time_point began = std::chrono::steady_clock::now();
  // Whatever takes longer the larger it is, is not for the connection's thread.
  bool is_large = false;
  // Of a large one with poses, instead of those of the message.
  std::shared_ptr<Result<PoseBatchRequest>> poses = nullptr;
  // What is held for the part of the reply that is as large as the request: it may wait for long.
  std::shared_ptr<const void> held_reply = nullptr;

  void Drop() {
    message.reset();
    held.reset();
  }
};

}  // namespace atlas
