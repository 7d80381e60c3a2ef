// A load generator's end of a connection to this machine, in the clear or with TLS 1.3. Reads do
// not block.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/base/bytes.h"
#include "core/base/status.h"

struct ssl_ctx_st;
struct ssl_st;

namespace atlas::testing {

// How to speak TLS: one cipher for every server, and no look at whom it is. Outlives its sockets.
class LoadTls {
 public:
  LoadTls();
  LoadTls(const LoadTls&) = delete;
  LoadTls& operator=(const LoadTls&) = delete;
  ~LoadTls();

  ssl_ctx_st* context() const { return context_; }

 private:
  ssl_ctx_st* context_;
};

class LoadSocket {
 public:
  // What a call brought: bytes, or nothing yet, or the end.
  struct Moved {
    std::size_t bytes = 0;
    bool is_closed = false;
  };

  // Connects and shakes hands; null `tls`: in the clear. kUnavailable.
  static Result<std::unique_ptr<LoadSocket>> Connect(std::uint16_t port, const LoadTls* tls);

  LoadSocket(const LoadSocket&) = delete;
  LoadSocket& operator=(const LoadSocket&) = delete;
  ~LoadSocket();

  int descriptor() const { return descriptor_; }
  // All of it; waits for the peer if it has to.
  Status Send(ByteSpan bytes);
  // What has come, one record at most. More may be there of which nobody tells: to be called until
  // it brings nothing.
  Moved Receive(std::span<std::uint8_t> into);
  // In the clear one call brings what the socket has, and what comes next is told of.
  bool may_hold_more() const { return session_ != nullptr; }
  // Closing sends a reset instead of an end.
  void ResetAtClose();

 private:
  explicit LoadSocket(int descriptor) : descriptor_(descriptor) {}

  Status Shake(const LoadTls& tls);
  std::ptrdiff_t SendSome(ByteSpan bytes);

  int descriptor_;
  ssl_st* session_ = nullptr;
};

}  // namespace atlas::testing
