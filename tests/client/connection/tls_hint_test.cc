// What is said where one end speaks TLS and the other does not.
#include "client/connection/tls_hint.h"

#include <array>

#include <boost/asio/error.hpp>
#include <gtest/gtest.h>

#include "proto/wire/convert.h"
#include "tests/client/support/test_peer.h"

namespace atlas {
namespace {

// Why nobody is reached there in the clear.
Status FailureWith(const std::function<void(PeerSocket&)>& serve) {
  const TestPeer peer(serve);
  auto client = AtlasClient::Connect(peer.options());
  if (client) return client->ReadStatus() ? Status() : client->ReadStatus().error();
  return client.error();
}

bool IsHinted(const Status& failure) {
  return failure.message().find("--tls-ca") != std::string::npos;
}

TEST(TlsHintTest, APeerThatSaysNothingMayExpectTls) {
  const Status closed = FailureWith([](PeerSocket& socket) { socket.ReadRequest(); });
  EXPECT_EQ(closed.code(), StatusCode::kUnavailable);
  EXPECT_TRUE(IsHinted(closed)) << closed.message();
}

TEST(TlsHintTest, SoMayOneThatSendsAnAlert) {
  const Status alerted = FailureWith([](PeerSocket& socket) {
    socket.ReadRequest();
    socket.Write(std::array<std::uint8_t, 7>{21, 3, 3, 0, 2, 2, 70});  // protocol_version
  });
  EXPECT_EQ(alerted.code(), StatusCode::kUnavailable);
  EXPECT_TRUE(IsHinted(alerted)) << alerted.message();
}

TEST(TlsHintTest, OneThatSpokeDoesNot) {
  const Status broken = FailureWith([](PeerSocket& socket) {
    AnswerHello(socket, {});
    socket.ReadRequest();
  });
  EXPECT_EQ(broken.code(), StatusCode::kUnavailable);
  EXPECT_FALSE(IsHinted(broken)) << broken.message();
  const Status other = FailureWith([](PeerSocket& socket) {
    socket.ReadRequest();
    socket.Write(std::array<std::uint8_t, 12>{'H', 'T', 'T', 'P', '/', '1', '.', '1', ' '});
  });
  EXPECT_EQ(other.code(), StatusCode::kInvalidData);
  EXPECT_FALSE(IsHinted(other)) << other.message();
}

TEST(TlsHintTest, WhoIsNotBelievedSpeaksTls) {
  namespace asio = boost::asio;
  EXPECT_FALSE(MayNotSpeakTls(asio::error::eof).empty());
  EXPECT_FALSE(MayNotSpeakTls(asio::error::connection_reset).empty());
  EXPECT_TRUE(MayNotSpeakTls(asio::error::timed_out).empty());
}

}  // namespace
}  // namespace atlas
