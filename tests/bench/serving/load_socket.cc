#include "tests/bench/serving/load_socket.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/str_cat.h"

namespace atlas::testing {
namespace {

constexpr const char* kCipher = "TLS_AES_256_GCM_SHA384";
constexpr std::size_t kReadAheadBytes = 256u << 10;  // as much as a call brings in the clear
constexpr int kPatience_ms = 10'000;

Status Failure(const char* what) {
  return {StatusCode::kUnavailable, StrCat(what, ": ", std::strerror(errno))};
}

}  // namespace

LoadTls::LoadTls() : context_(SSL_CTX_new(TLS_client_method())) {
  if (context_ == nullptr || SSL_CTX_set_min_proto_version(context_, TLS1_3_VERSION) != 1 ||
      SSL_CTX_set_ciphersuites(context_, kCipher) != 1) {
    throw std::runtime_error("TLS: no context");
  }
  SSL_CTX_set_verify(context_, SSL_VERIFY_NONE, nullptr);
  SSL_CTX_set_read_ahead(context_, 1);
  SSL_CTX_set_default_read_buffer_len(context_, kReadAheadBytes);
  SSL_CTX_set_mode(context_, SSL_MODE_RELEASE_BUFFERS);
}

LoadTls::~LoadTls() {
  SSL_CTX_free(context_);
}

LoadSocket::~LoadSocket() {
  SSL_free(session_);
  ::close(descriptor_);
}

Result<std::unique_ptr<LoadSocket>> LoadSocket::Connect(std::uint16_t port, const LoadTls* tls) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM, 0);
  if (descriptor < 0) {
    return Error(Failure("socket"));
  }
  std::unique_ptr<LoadSocket> made(new LoadSocket(descriptor));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return Error(Failure("connect"));
  }
  const int on = 1;
  ::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  if (tls != nullptr) {
    if (Status status = made->Shake(*tls); !status.ok()) {
      return Error(std::move(status));
    }
  }
  if (::fcntl(descriptor, F_SETFL, O_NONBLOCK) != 0) {
    return Error(Failure("fcntl"));
  }
  return made;
}

Status LoadSocket::Shake(const LoadTls& tls) {
  session_ = SSL_new(tls.context());
  if (session_ == nullptr || SSL_set_fd(session_, descriptor_) != 1 || SSL_connect(session_) != 1) {
    ERR_clear_error();
    return {StatusCode::kUnavailable, "the TLS handshake failed"};
  }
  return {};
}

// Below 0: not now, or never again.
std::ptrdiff_t LoadSocket::SendSome(ByteSpan bytes) {
  if (session_ == nullptr) {
    return ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  std::size_t size = 0;
  const int result = SSL_write_ex(session_, bytes.data(), bytes.size(), &size);
  if (result == 1) {
    return static_cast<std::ptrdiff_t>(size);
  }
  const int error = SSL_get_error(session_, result);
  ERR_clear_error();
  errno = error == SSL_ERROR_WANT_WRITE || error == SSL_ERROR_WANT_READ ? EAGAIN : EPIPE;
  return -1;
}

Status LoadSocket::Send(ByteSpan bytes) {
  while (!bytes.empty()) {
    const std::ptrdiff_t size = SendSome(bytes);
    if (size > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(size));
      continue;
    }
    if (errno != EAGAIN) {
      return Failure("send");
    }
    pollfd wait{descriptor_, POLLOUT, 0};
    if (::poll(&wait, 1, kPatience_ms) <= 0) {
      return {StatusCode::kTimeout, "the server takes nothing"};
    }
  }
  return {};
}

LoadSocket::Moved LoadSocket::Receive(std::span<std::uint8_t> into) {
  if (session_ == nullptr) {
    const ssize_t size = ::recv(descriptor_, into.data(), into.size(), 0);
    return size > 0 ? Moved{static_cast<std::size_t>(size), false}
                    : Moved{0, size == 0 || errno != EAGAIN};
  }
  std::size_t size = 0;
  const int result = SSL_read_ex(session_, into.data(), into.size(), &size);
  if (result == 1) {
    return {size, false};
  }
  const bool is_waiting = SSL_get_error(session_, result) == SSL_ERROR_WANT_READ;
  ERR_clear_error();
  return {0, !is_waiting};
}

void LoadSocket::ResetAtClose() {
  const linger now{1, 0};
  ::setsockopt(descriptor_, SOL_SOCKET, SO_LINGER, &now, sizeof(now));
}

}  // namespace atlas::testing
