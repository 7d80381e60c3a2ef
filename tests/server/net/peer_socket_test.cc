#include "server/net/peer_socket.h"

#include <array>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <gtest/gtest.h>

namespace atlas {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

// A peer that connected, and how the daemon has it.
class PeerSocketTest : public ::testing::Test {
 protected:
  PeerSocketTest() {
    peer_.connect(acceptor_.local_endpoint());
    acceptor_.accept(socket_);
  }
  void Send() { asio::write(peer_, asio::buffer(std::array<char, 1>{'R'})); }

  asio::io_context io_;
  tcp::acceptor acceptor_{io_, tcp::endpoint(asio::ip::address_v4::loopback(), 0)};
  tcp::socket peer_{io_};
  tcp::socket socket_{io_};
};

TEST_F(PeerSocketTest, WhoIsSilentIsThere) {
  EXPECT_FALSE(IsGone(socket_));
  Send();
  EXPECT_FALSE(IsGone(socket_));
}

TEST_F(PeerSocketTest, WhoClosedAndSaidNothingIsGone) {
  peer_.close();
  EXPECT_TRUE(IsGone(socket_));
}

TEST_F(PeerSocketTest, WhoSaidSomethingAndSendsNoMoreIsThere) {
  Send();
  peer_.shutdown(tcp::socket::shutdown_send);
  EXPECT_FALSE(IsGone(socket_));
  std::array<char, 1> byte{};
  EXPECT_EQ(asio::read(socket_, asio::buffer(byte)), 1u) << "it is still to be read";
}

TEST_F(PeerSocketTest, WhoResetItIsGone) {
  Send();
  peer_.set_option(tcp::socket::linger(true, 0));
  peer_.close();
  EXPECT_TRUE(IsGone(socket_));
}

}  // namespace
}  // namespace atlas
