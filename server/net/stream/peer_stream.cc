#include "server/net/stream/peer_stream.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <linux/sockios.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

// A peer changes its key now and then, after gigabytes. Each time costs ours a derivation, so who
// does nothing else has to go: so many are free, and one for so many bytes.
constexpr std::uint64_t kFreeKeyUpdates = 16;
constexpr std::uint64_t kBytesForKeyUpdate = 1u << 20;

// Of what a call to the socket returned.
PeerStream::Moved MovedBy(ssize_t result, std::size_t asked) {
  if (result < 0) {
    const bool is_blocked = errno == EAGAIN || errno == EINTR;
    return {0, is_blocked, !is_blocked};
  }
  const auto bytes = static_cast<std::size_t>(result);
  return {bytes, bytes < asked, bytes == 0};
}

}  // namespace

PeerStream::PeerStream(tcp::socket socket, SslSession session)
    : socket_(std::move(socket)), session_(std::move(session)) {
  error_code error;
  socket_.native_non_blocking(true, error);
  if (error) {  // it would hold up its thread
    Close();
  }
  if (session_ != nullptr) {
    SSL_set_msg_callback(session_.get(), &CountKeyUpdates);
    SSL_set_msg_callback_arg(session_.get(), this);
  }
}

void PeerStream::CountKeyUpdates(int is_written,
                                 int /*version*/,
                                 int content_type,
                                 const void* message,
                                 std::size_t size,
                                 ssl_st* session,
                                 void* stream) {
  if (is_written == 0 && content_type == SSL3_RT_HANDSHAKE && size > 0 &&
      *static_cast<const std::uint8_t*>(message) == SSL3_MT_KEY_UPDATE) {
    PeerStream& self = *static_cast<PeerStream*>(stream);
    ++self.key_updates_;
    // While less than the head of a record is left in its buffer OpenSSL fills that up and goes on:
    // records of the right length would keep it reading for ever.
    if (self.HasTooManyKeyUpdates()) {
      SSL_set_read_ahead(session, 0);
    }
  }
}

bool PeerStream::HasTooManyKeyUpdates() const {
  return key_updates_ > kFreeKeyUpdates + received_bytes_ / kBytesForKeyUpdate;
}

asio::ip::address PeerStream::PeerAddress() const {
  error_code error;
  return socket_.remote_endpoint(error).address();
}

std::string PeerStream::PeerName() const {
  error_code error;
  const auto endpoint = socket_.remote_endpoint(error);
  return error ? "unknown" : StrCat(endpoint);
}

PeerStream::Moved PeerStream::Read(std::span<std::uint8_t> into) {
  if (session_ != nullptr) {
    return ReadSession(into);
  }
  const Moved came =
      MovedBy(::recv(socket_.native_handle(), into.data(), into.size(), 0), into.size());
  has_read_ = has_read_ || came.bytes > 0;
  return came;
}

PeerStream::Moved PeerStream::Write(std::span<const ByteSpan> pieces) {
  if (session_ != nullptr) {
    return WriteSession(pieces);
  }
  std::array<iovec, kMaxPieces> vectors;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  std::size_t asked = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    // Sending does not change them.
    vectors[i] = {const_cast<std::uint8_t*>(pieces[i].data()), pieces[i].size()};
    asked += pieces[i].size();
  }
  msghdr message{};
  message.msg_iov = vectors.data();
  message.msg_iovlen = pieces.size();
  return MovedBy(::sendmsg(socket_.native_handle(), &message, MSG_NOSIGNAL), asked);
}

PeerStream::Moved PeerStream::ReadSession(std::span<std::uint8_t> into) {
  ERR_clear_error();
  std::size_t size = 0;
  const int result = SSL_read_ex(session_.get(), into.data(), into.size(), &size);
  // After a failure OpenSSL takes every handshake for one that is not done.
  has_shaken_hands_ = has_shaken_hands_ || SSL_is_init_finished(session_.get()) == 1;
  if (HasTooManyKeyUpdates()) {
    failure_ = StrCat(key_updates_, " changes of the key with ", received_bytes_, " bytes");
    return {0, false, true};
  }
  received_bytes_ += size;
  return result == 1 ? Moved{size} : NotMovedBy(result, read_waits_to_write_);
}

// A record at a time. What was not taken is given again, from its beginning.
PeerStream::Moved PeerStream::WriteSession(std::span<const ByteSpan> pieces) {
  std::array<std::uint8_t, SSL3_RT_MAX_PLAIN_LENGTH> record;  // NOLINT(*-member-init)
  std::size_t size = 0;
  for (const ByteSpan piece : pieces) {
    const std::size_t part = std::min(piece.size(), record.size() - size);
    std::copy_n(piece.begin(), part, record.begin() + static_cast<std::ptrdiff_t>(size));
    size += part;
  }
  ERR_clear_error();
  std::size_t written = 0;
  const int result = SSL_write_ex(session_.get(), record.data(), size, &written);
  return result == 1 ? Moved{written} : NotMovedBy(result, write_waits_to_read_);
}

PeerStream::Moved PeerStream::NotMovedBy(int result, bool& waits_for_other) {
  const int error = SSL_get_error(session_.get(), result);
  const bool is_read = &waits_for_other == &read_waits_to_write_;
  if (error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE) {
    waits_for_other = (error == SSL_ERROR_WANT_READ) != is_read;
    return {0, true, false};
  }
  if (error == SSL_ERROR_SSL) {
    failure_ = TakeTlsErrors();
  }
  return {0, false, true};
}

asio::awaitable<void> PeerStream::WaitUntilReadable(asio::cancellation_slot stop) {
  error_code ignored;  // the next Read() tells
  co_await socket_.async_wait(
      read_waits_to_write_ ? tcp::socket::wait_write : tcp::socket::wait_read,
      asio::bind_cancellation_slot(stop, asio::redirect_error(asio::use_awaitable, ignored)));
}

asio::awaitable<void> PeerStream::WaitUntilWritable() {
  error_code ignored;  // the next Write() tells
  co_await socket_.async_wait(
      write_waits_to_read_ ? tcp::socket::wait_read : tcp::socket::wait_write,
      asio::redirect_error(asio::use_awaitable, ignored));
}

std::size_t PeerStream::unacknowledged_bytes() {
  int bytes = 0;
  return ::ioctl(socket_.native_handle(), SIOCOUTQ, &bytes) == 0 ? static_cast<std::size_t>(bytes)
                                                                 : 0;
}

bool PeerStream::has_received() const {
  return has_read_ || (session_ != nullptr && BIO_number_read(SSL_get_rbio(session_.get())) > 0);
}

bool PeerStream::has_unread() {
  error_code gone;
  return (session_ != nullptr && SSL_has_pending(session_.get()) == 1) ||
         socket_.available(gone) > 0;
}

Status PeerStream::CheckCertificate(const TlsContext& tls) const {
  return session_ == nullptr ? Status() : tls.CheckPeer(*session_);
}

std::optional<PeerCertificate> PeerStream::certificate() const {
  return session_ == nullptr ? std::nullopt : CertificateOf(*session_);
}

void PeerStream::DropUnsent() {
  error_code ignored;  // a peer that is gone already
  socket_.set_option(tcp::socket::linger(true, 0), ignored);
}

void PeerStream::CloseSending() {
  if (session_ != nullptr && SSL_is_init_finished(session_.get()) == 1) {
    SSL_shutdown(session_.get());  // a notice, that may not fit any more
    ERR_clear_error();
  }
  error_code ignored;  // a peer that is gone already
  socket_.shutdown(tcp::socket::shutdown_send, ignored);
}

void PeerStream::Close() {
  error_code ignored;  // a peer that is gone already
  socket_.shutdown(tcp::socket::shutdown_both, ignored);
  socket_.close(ignored);
}

}  // namespace atlas
