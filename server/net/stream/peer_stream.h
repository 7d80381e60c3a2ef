// The bytes to and from one peer, through TLS or not. Nothing here blocks: what the socket does not
// give or take now is awaited. For the thread of the socket's executor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "core/base/bytes.h"
#include "server/net/stream/tls_context.h"

namespace atlas {

class PeerStream {
 public:
  static constexpr std::size_t kMaxPieces = 64;

  struct Moved {
    std::size_t bytes = 0;
    bool is_blocked = false;  // there is no more for now
    bool is_closed = false;   // there will be no more: the peer closed, or is gone
  };

  // Without a session the bytes go as they are; with one, the first reads and writes are its
  // handshake.
  explicit PeerStream(boost::asio::ip::tcp::socket socket, SslSession session = nullptr);
  PeerStream(const PeerStream&) = delete;
  PeerStream& operator=(const PeerStream&) = delete;
  ~PeerStream() = default;

  // Of the peer; none when it is gone.
  boost::asio::ip::address PeerAddress() const;
  // "ADDRESS:PORT" of the peer.
  std::string PeerName() const;
  boost::asio::any_io_executor executor() { return socket_.get_executor(); }

  Moved Read(std::span<std::uint8_t> into);
  // Up to kMaxPieces pieces, in order; how many bytes of them left.
  Moved Write(std::span<const ByteSpan> pieces);

  // Return when it is worth another try, when the stream is closed, or when `stop` is emitted.
  boost::asio::awaitable<void> WaitUntilReadable(boost::asio::cancellation_slot stop);
  boost::asio::awaitable<void> WaitUntilWritable();

  // Given to the system, and not known to have come.
  std::size_t unacknowledged_bytes();
  // Bytes have come and were read, those of a handshake, too.
  bool has_received() const;
  // Bytes have come that were not read.
  bool has_unread();
  // That the peer showed and that was verified; once bytes were read.
  std::optional<PeerCertificate> certificate() const;
  // Whether this context believes it, too; ok where there is none. kPermissionDenied.
  Status CheckCertificate(const TlsContext& tls) const;
  bool is_encrypted() const { return session_ != nullptr; }
  // The peer has begun a handshake, and it is not done.
  bool is_shaking_hands() const {
    return session_ != nullptr && !has_shaken_hands_ && has_received();
  }
  // Why TLS closed it; empty: it did not.
  const std::string& failure() const { return failure_; }
  // Closing forgets what the system has not sent yet.
  void DropUnsent();
  void CloseSending();
  void Close();

 private:
  Moved ReadSession(std::span<std::uint8_t> into);
  Moved WriteSession(std::span<const ByteSpan> pieces);
  // For OpenSSL, of each message of TLS itself that came or leaves; `stream`: whose.
  static void CountKeyUpdates(int is_written,
                              int version,
                              int content_type,
                              const void* message,
                              std::size_t size,
                              ssl_st* session,
                              void* stream);
  bool HasTooManyKeyUpdates() const;
  // Of a call to the session that did not succeed.
  Moved NotMovedBy(int result, bool& waits_for_other);

  boost::asio::ip::tcp::socket socket_;
  SslSession session_;
  bool has_read_ = false;             // in the clear
  bool has_shaken_hands_ = false;     // with TLS
  bool read_waits_to_write_ = false;  // in a handshake
  bool write_waits_to_read_ = false;
  std::uint64_t received_bytes_ = 0;  // without those of TLS
  std::uint64_t key_updates_ = 0;     // that the peer made
  std::string failure_;
};

}  // namespace atlas
