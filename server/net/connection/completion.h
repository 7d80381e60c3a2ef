// The end of a connection's coroutine: the one place where what escapes one is caught. It keeps the
// connection alive until then.
#pragma once

#include <exception>
#include <memory>
#include <string>
#include <utility>

#include <spdlog/spdlog.h>

#include "core/base/str_cat.h"
#include "server/net/connection/peer_connection.h"

namespace atlas {

class Completion {
 public:
  Completion(std::shared_ptr<PeerConnection> connection, const char* what)
      : connection_(std::move(connection)), what_(what) {}

  void operator()(std::exception_ptr failure) const {
    if (!failure) {
      return;
    }
    try {
      std::rethrow_exception(failure);
    } catch (const std::exception& error) {
      const std::string message = StrCat(what_, " failed: ", error.what());
      spdlog::error("{}", connection_->peer().Line(message).text());
    }
    connection_->CloseNow();
  }

 private:
  std::shared_ptr<PeerConnection> connection_;
  const char* what_;
};

}  // namespace atlas
