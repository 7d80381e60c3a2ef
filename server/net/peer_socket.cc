#include "server/net/peer_socket.h"

#include <utility>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

namespace atlas {

using boost::asio::ip::tcp;

void PreparePeerSocket(tcp::socket& socket, int max_unsent_bytes) {
  boost::system::error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  socket.set_option(tcp::socket::keep_alive(true), ignored);
  for (const auto& [option, value] :
       {std::pair(TCP_KEEPIDLE, 60), std::pair(TCP_KEEPINTVL, 15), std::pair(TCP_KEEPCNT, 4),
        std::pair(TCP_NOTSENT_LOWAT, max_unsent_bytes)}) {
    ::setsockopt(socket.native_handle(), IPPROTO_TCP, option, &value, sizeof(value));
  }
}

bool IsGone(tcp::socket& socket) {
  pollfd state{socket.native_handle(), POLLIN, 0};
  if (::poll(&state, 1, 0) <= 0) {
    return false;
  }
  char byte = 0;
  return (state.revents & (POLLERR | POLLHUP)) != 0 ||
         ::recv(state.fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

}  // namespace atlas
