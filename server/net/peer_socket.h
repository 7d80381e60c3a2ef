// What a peer's socket is told, and asked, before it is served.
#pragma once

#include <boost/asio/ip/tcp.hpp>

namespace atlas {

// Small replies leave at once; a peer that lost its link is gone after two minutes without an
// answer; the system keeps no more than `max_unsent_bytes` that have not left. Else it takes
// megabytes for a slow link, and is heard of again when a third of them left: at 256 kbit/s longer
// than a peer may take nothing. An option that fails is none that replies depend on.
void PreparePeerSocket(boost::asio::ip::tcp::socket& socket, int max_unsent_bytes);

// While it waited for its turn its peer reset it, or closed it and had sent nothing: one that sends
// its Hello and no more is there.
bool IsGone(boost::asio::ip::tcp::socket& socket);

}  // namespace atlas
