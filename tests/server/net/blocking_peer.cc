#include "tests/server/net/blocking_peer.h"

#include <array>
#include <cerrno>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

namespace atlas {
namespace {

constexpr timeval kPatience{30, 0};

sockaddr_in AddressOf(std::uint16_t port, std::uint8_t host) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl((INADDR_LOOPBACK & ~0xFFu) | host);
  return address;
}

int Connect(std::uint16_t port, int buffer_bytes, std::uint8_t from = 1) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (buffer_bytes != 0) {
    ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof buffer_bytes);
    ::setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &buffer_bytes, sizeof buffer_bytes);
  }
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
  const sockaddr_in own = AddressOf(0, from);
  const sockaddr_in address = AddressOf(port, 1);
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0 &&
      ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    return fd;
  }
  ::close(fd);
  return -1;
}

bool IsWritable(int fd, std::chrono::milliseconds patience) {
  pollfd waiting{fd, POLLOUT, 0};
  return ::poll(&waiting, 1, static_cast<int>(patience.count())) == 1 &&
         (waiting.revents & (POLLERR | POLLHUP)) == 0;
}

}  // namespace

BlockingPeer::BlockingPeer(std::uint16_t port, int buffer_bytes)
    : fd_(Connect(port, buffer_bytes)) {}

BlockingPeer::BlockingPeer(std::uint16_t port, From from) : fd_(Connect(port, 0, from.host)) {}

BlockingPeer::BlockingPeer(std::uint16_t port, const Tls& tls, int buffer_bytes)
    : fd_(Connect(port, buffer_bytes)) {
  SSL_CTX* const context = SSL_CTX_new(TLS_client_method());
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
  EXPECT_EQ(SSL_CTX_load_verify_file(context, tls.authority.c_str()), 1);
  if (tls.own) {
    EXPECT_EQ(SSL_CTX_use_certificate_chain_file(context, tls.own->certificate.c_str()), 1);
    EXPECT_EQ(SSL_CTX_use_PrivateKey_file(context, tls.own->key.c_str(), SSL_FILETYPE_PEM), 1);
  }
  SSL_CTX_set_max_proto_version(context, tls.max_version);
  session_.reset(SSL_new(context));
  SSL_CTX_free(context);  // the session has its share
  SSL_set_fd(session_.get(), fd_);
  if (SSL_connect(session_.get()) != 1) {
    session_.reset();
  }
}

void BlockingPeer::SslFree::operator()(ssl_st* session) const {
  SSL_free(session);
}

std::string BlockingPeer::PeerName() const {
  std::array<char, 128> name{};
  X509_NAME_get_text_by_NID(X509_get_subject_name(SSL_get0_peer_certificate(session_.get())),
                            NID_commonName, name.data(), name.size());
  return name.data();
}

bool BlockingPeer::ChangeKeys(int times) {
  bool is_sent = true;
  for (int i = 0; is_sent && i < times; ++i) {
    is_sent = SSL_key_update(session_.get(), SSL_KEY_UPDATE_NOT_REQUESTED) == 1 &&
              SSL_do_handshake(session_.get()) == 1;
  }
  return is_sent;
}

bool BlockingPeer::FloodWithKeyChanges(int times, std::size_t padding) {
  SSL_set_block_padding(session_.get(), 1);  // else there is none
  SSL_set_record_padding_callback_arg(session_.get(), &padding);
  SSL_set_record_padding_callback(session_.get(), [](ssl_st*, int, std::size_t, void* bytes) {
    return *static_cast<std::size_t*>(bytes);
  });
  BIO* const kept = BIO_new(BIO_s_mem());
  SSL_set0_wbio(session_.get(), kept);
  bool is_made = ChangeKeys(times);
  SSL_set_record_padding_callback(session_.get(), nullptr);
  char* data = nullptr;
  const long size = BIO_get_mem_data(kept, &data);
  for (long sent = 0; is_made && sent < size;) {
    const ssize_t part =
        ::send(fd_, data + sent, static_cast<std::size_t>(size - sent), MSG_NOSIGNAL);
    is_made = part > 0;
    sent += part;
  }
  return is_made;
}

BlockingPeer::~BlockingPeer() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

bool BlockingPeer::SendBytes(ByteSpan bytes) const {
  while (!bytes.empty()) {
    const ssize_t sent =
        session_ ? SSL_write(session_.get(), bytes.data(), static_cast<int>(bytes.size()))
                 : ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) {
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

bool BlockingPeer::Send(const wire::Envelope& envelope) const {
  return SendBytes(EncodeEnvelopeFrame(envelope).value());
}

std::size_t BlockingPeer::SendUntilStuck(ByteSpan bytes, std::chrono::milliseconds patience) const {
  std::size_t total = 0;
  while (total < bytes.size() && IsWritable(fd_, patience)) {
    const ssize_t sent =
        ::send(fd_, bytes.data() + total, bytes.size() - total, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent <= 0) {
      break;
    }
    total += static_cast<std::size_t>(sent);
  }
  return total;
}

void BlockingPeer::CloseSending() const {
  ::shutdown(fd_, SHUT_WR);
}

std::optional<wire::Envelope> BlockingPeer::Receive(std::size_t* size_bytes) {
  while (true) {
    auto next = decoder_.Next();
    EXPECT_TRUE(next.has_value()) << next.error().message();
    if (next && *next) {
      if (size_bytes != nullptr) {
        *size_bytes = kFrameHeaderBytes + (*next)->size();
      }
      return ParseEnvelope(**next).value();
    }
    std::array<std::uint8_t, 16'384> chunk{};
    const ssize_t size =
        session_ ? SSL_read(session_.get(), chunk.data(), static_cast<int>(chunk.size()))
                 : ::recv(fd_, chunk.data(), chunk.size(), 0);
    if (size <= 0) {
      EXPECT_TRUE(size == 0 || errno != EAGAIN) << "the daemon neither answered nor closed";
      return std::nullopt;
    }
    decoder_.Push(ByteSpan(chunk).first(static_cast<std::size_t>(size)));
  }
}

wire::Envelope BlockingPeer::Greet(std::uint32_t major,
                                   const std::string& profile,
                                   const std::string& token) {
  wire::Envelope hello;
  hello.set_request_id(1);
  hello.mutable_hello()->set_protocol_major(major);
  hello.mutable_hello()->set_profile(profile);
  hello.mutable_hello()->set_token(token);
  Send(hello);
  return Receive().value_or(wire::Envelope());
}

}  // namespace atlas
