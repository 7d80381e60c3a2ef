// A client of blocking sockets that can say anything, right or wrong. Every wait ends: a daemon
// that stays silent fails the test.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "proto/wire/envelope.h"
#include "tests/server/net/test_certificates.h"

struct ssl_st;

namespace atlas {

class BlockingPeer {
 public:
  // Connects to a port of loopback. `buffer_bytes`: of the socket's buffers; 0 leaves the system's.
  explicit BlockingPeer(std::uint16_t port, int buffer_bytes = 0);
  // From another address of loopback: 127.0.0.`host`.
  struct From {
    std::uint8_t host = 1;
  };
  BlockingPeer(std::uint16_t port, From from);
  // Through TLS: whom it believes, and what it shows if asked. `max_version` as OpenSSL has it; 0:
  // the newest.
  struct Tls {
    std::filesystem::path authority;
    std::optional<CertificateFiles> own = std::nullopt;
    int max_version = 0;
  };
  BlockingPeer(std::uint16_t port, const Tls& tls, int buffer_bytes = 0);
  BlockingPeer(const BlockingPeer&) = delete;
  BlockingPeer& operator=(const BlockingPeer&) = delete;
  ~BlockingPeer();

  bool is_connected() const { return fd_ >= 0; }
  // The handshake went well, as far as this end knows.
  bool is_encrypted() const { return session_ != nullptr; }
  // The common name that the daemon showed.
  std::string PeerName() const;

  // Changes the key of what is sent, so many times. False when the daemon closed.
  bool ChangeKeys(int times);
  // The same all at once, with so many bytes of padding each: nothing else can be sent after it.
  bool FloodWithKeyChanges(int times, std::size_t padding);
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
  wire::Envelope Greet(std::uint32_t major = kProtocolMajor,
                       const std::string& profile = "",
                       const std::string& token = "");

 private:
  struct SslFree {
    void operator()(ssl_st* session) const;
  };

  int fd_;
  std::unique_ptr<ssl_st, SslFree> session_;
  FrameDecoder decoder_;
};

}  // namespace atlas
