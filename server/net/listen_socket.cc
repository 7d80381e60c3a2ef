#include "server/net/listen_socket.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <unistd.h>

#include "core/base/str_cat.h"

namespace atlas {

Result<ListenSocket> ListenSocket::Open(const std::string& host, std::uint16_t port) {
  namespace asio = boost::asio;
  using asio::ip::tcp;
  boost::system::error_code error;
  const asio::ip::address address = asio::ip::make_address(host, error);
  if (error) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("listen address '", host, "' is no IP address"));
  }
  const tcp::endpoint endpoint(address, port);
  asio::io_context io;
  tcp::acceptor acceptor(io);
  acceptor.open(endpoint.protocol(), error);
  if (!error) {
    acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  }
  if (!error) {
    acceptor.bind(endpoint, error);
  }
  if (!error) {
    acceptor.listen(asio::socket_base::max_listen_connections, error);
  }
  if (error) {
    return Error(StatusCode::kUnavailable,
                 StrCat("cannot listen on ", endpoint, ": ", error.message()));
  }
  const tcp::endpoint bound = acceptor.local_endpoint();
  ListenSocket socket;
  socket.address_ = StrCat(bound);
  socket.port_ = bound.port();
  socket.is_ip6_ = address.is_v6();
  socket.descriptor_ = acceptor.release();
  return socket;
}

ListenSocket::~ListenSocket() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
}

}  // namespace atlas
