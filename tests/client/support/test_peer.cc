#include "tests/client/support/test_peer.h"

#include <array>
#include <cstring>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "proto/wire/convert.h"

namespace atlas {

bool PeerSocket::Write(ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

bool PeerSocket::Reply(std::uint64_t request_id, wire::Envelope reply) {
  reply.set_request_id(request_id);
  return Write(*EncodeEnvelopeFrame(reply));
}

std::optional<wire::Envelope> PeerSocket::ReadRequest() {
  while (true) {
    auto payload = decoder_.Next();
    if (!payload) return std::nullopt;
    if (*payload) return *ParseEnvelope(**payload);
    std::array<std::uint8_t, 65536> chunk{};
    const ssize_t size = recv(fd_, chunk.data(), chunk.size(), 0);
    if (size <= 0) return std::nullopt;
    decoder_.Push(ByteSpan(chunk).first(static_cast<std::size_t>(size)));
  }
}

void PeerSocket::Drain() {
  std::array<std::uint8_t, 4096> chunk{};
  while (recv(fd_, chunk.data(), chunk.size(), 0) > 0) {
  }
}

void PeerSocket::EndWriting() {
  shutdown(fd_, SHUT_WR);
}

TestPeer::TestPeer(std::function<void(PeerSocket&)> serve)
    : listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  socklen_t size = sizeof(address);
  if (bind(listener_, generic, size) != 0 || listen(listener_, 4) != 0 ||
      getsockname(listener_, generic, &size) != 0) {
    throw std::runtime_error("no loopback port to listen on");
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this, serve = std::move(serve)] {
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (fd < 0) return;
    PeerSocket socket(fd);
    serve(socket);
    close(fd);
  });
}

TestPeer::~TestPeer() {
  shutdown(listener_, SHUT_RDWR);  // wakes an accept that nobody came for
  thread_.join();
  close(listener_);
}

ConnectionOptions TestPeer::options() const {
  ConnectionOptions options;
  options.endpoint = endpoint();
  options.connect_timeout = std::chrono::milliseconds(2'000);
  options.request_timeout = std::chrono::milliseconds(200);
  return options;
}

void AnswerHello(PeerSocket& socket,
                 const MapProfile& profile,
                 const PeerIdentity& client,
                 const PeerAtlas& atlas) {
  const auto request = socket.ReadRequest();
  if (!request) return;
  wire::Envelope reply;
  wire::HelloReply& hello = *reply.mutable_hello_reply();
  hello.set_protocol_major(kProtocolMajor);
  hello.set_profile(ProfileToWire(profile));
  hello.set_atlas_id(atlas.id);
  hello.set_epoch(atlas.epoch);
  hello.set_revision(7);
  hello.set_name(client.name);
  hello.set_role(client.role);
  socket.Reply(request->request_id(), std::move(reply));
}

}  // namespace atlas
