// Sockets of 127.0.0.1 for daemons and clients under test. Every wait ends after a while, and the
// program with it: nobody here is silent for so long.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

#include "core/base/bytes.h"

namespace atlas::fuzz {

class LoopbackSocket {
 public:
  explicit LoopbackSocket(int fd) : fd_(fd) {}
  static LoopbackSocket Connect(std::uint16_t port);
  LoopbackSocket(const LoopbackSocket&) = delete;
  LoopbackSocket& operator=(const LoopbackSocket&) = delete;
  LoopbackSocket(LoopbackSocket&&) = delete;
  LoopbackSocket& operator=(LoopbackSocket&&) = delete;
  ~LoopbackSocket();

  // False when the other end is gone.
  bool Send(ByteSpan bytes) const;
  void CloseSending() const;
  // What has come; empty when the other end has closed.
  Bytes Receive() const;

 private:
  int fd_;
};

// Says the same to whoever connects, once something was heard, and listens until he is gone.
class ReciteServer {
 public:
  ReciteServer();
  ReciteServer(const ReciteServer&) = delete;
  ReciteServer& operator=(const ReciteServer&) = delete;
  ReciteServer(ReciteServer&&) = delete;
  ReciteServer& operator=(ReciteServer&&) = delete;
  ~ReciteServer();

  std::uint16_t port() const { return port_; }
  // To the next one.
  void SetText(ByteSpan text);

 private:
  void Serve();

  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::mutex mutex_;
  Bytes text_;
  std::thread thread_;
};

}  // namespace atlas::fuzz
