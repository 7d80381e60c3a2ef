// A client of blocking sockets that can say anything, right or wrong. Every wait ends: a daemon
// that stays silent fails the test.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "proto/wire/envelope.h"

namespace atlas {

class BlockingPeer {
 public:
  // Connects to a port of loopback. `buffer_bytes`: of the socket's buffers; 0 leaves the system's.
  explicit BlockingPeer(std::uint16_t port, int buffer_bytes = 0);
  BlockingPeer(const BlockingPeer&) = delete;
  BlockingPeer& operator=(const BlockingPeer&) = delete;
  ~BlockingPeer();

  bool is_connected() const { return fd_ >= 0; }

  // False when the daemon closed.
  bool SendBytes(ByteSpan bytes) const;
  bool Send(const wire::Envelope& envelope) const;
  // The bytes that the daemon takes until it takes none for `patience`, or closes.
  std::size_t SendUntilStuck(ByteSpan bytes, std::chrono::milliseconds patience) const;
  void CloseSending() const;

  // The next frame; nullopt when the daemon closed. `size_bytes` gets its size with the header.
  std::optional<wire::Envelope> Receive(std::size_t* size_bytes = nullptr);
  // True when the daemon closes without another frame.
  bool IsClosed() { return !Receive().has_value(); }

  // Sends a Hello; its reply, or the error that came instead.
  wire::Envelope Greet(std::uint32_t major = kProtocolMajor, const std::string& profile = "");

 private:
  int fd_;
  FrameDecoder decoder_;
};

}  // namespace atlas
