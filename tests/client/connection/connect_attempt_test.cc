// An attempt over several calls: what one leaves goes on in the next, and all of it has one
// deadline.
#include "client/connection/connect_attempt.h"

#include <future>
#include <memory>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "proto/wire/convert.h"
#include "tests/client/support/gated_resolver.h"
#include "tests/client/support/test_peer.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kDeadline{1'000};
const milliseconds kLong{20'000};

// An address of this machine whose queue of connections is full.
class SilentAddress {
 public:
  SilentAddress(const char* host, std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    inet_pton(AF_INET, host, &address.sin_addr);
    const auto* const generic = reinterpret_cast<const sockaddr*>(&address);
    sockets_.push_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    is_there_ = ::bind(sockets_[0], generic, sizeof address) == 0 && ::listen(sockets_[0], 0) == 0;
    for (int i = 0; i < 4; ++i) {
      sockets_.push_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
      (void)::connect(sockets_.back(), generic, sizeof address);
    }
  }
  ~SilentAddress() {
    for (const int socket : sockets_) {
      ::close(socket);
    }
  }
  SilentAddress(const SilentAddress&) = delete;
  SilentAddress& operator=(const SilentAddress&) = delete;

  // False: somebody else has that port there.
  bool is_there() const { return is_there_; }

 private:
  bool is_there_ = false;
  std::vector<int> sockets_;
};

ConnectProgress ToTheEnd(const ConnectionOptions& options) {
  return ConnectAttempt(options).Continue(options.connect_timeout);
}

// Of a peer that answers the Hello with this.
ConnectProgress Refused(StatusCode code, bool is_of_the_connection = false) {
  const TestPeer peer([code, is_of_the_connection](PeerSocket& socket) {
    const auto hello = socket.ReadRequest();
    wire::Envelope reply;
    *reply.mutable_error() = ErrorToWire({code, "no"});
    socket.Reply(is_of_the_connection ? 0 : hello->request_id(), std::move(reply));
    socket.Drain();
  });
  return ToTheEnd(peer.options());
}

TEST(ConnectAttemptTest, APeerThatAnswersLateIsWaitedForOverManyCalls) {
  std::promise<void> answer;
  const TestPeer peer([may_answer = answer.get_future().share()](PeerSocket& socket) {
    may_answer.wait_for(kLong);
    AnswerHello(socket, {});
    socket.Drain();
  });
  ConnectionOptions options = peer.options();
  options.connect_timeout = kLong;
  options.request_timeout = milliseconds(1);  // is no part of it
  ConnectAttempt attempt(options);
  for (int call = 0; call < 10; ++call) {
    const ConnectProgress progress = attempt.Continue(milliseconds(5));
    EXPECT_FALSE(progress.client);
    ASSERT_TRUE(progress.failure.ok()) << progress.failure.message();
  }
  answer.set_value();
  const ConnectProgress progress = attempt.Continue(kLong);
  ASSERT_TRUE(progress.client) << progress.failure.message();
  EXPECT_EQ(progress.client->atlas().revision, 7U);
}

TEST(ConnectAttemptTest, ASilentPeerHoldsItNoLongerThanItsDeadline) {
  const TestPeer peer([](PeerSocket& socket) { socket.Drain(); });
  ConnectionOptions options = peer.options();
  options.connect_timeout = kDeadline;
  options.request_timeout = std::chrono::hours(1);
  const Clock::time_point start = Clock::now();
  const ConnectProgress progress = ToTheEnd(options);
  EXPECT_EQ(progress.failure.code(), StatusCode::kTimeout) << progress.failure.message();
  EXPECT_FALSE(progress.is_final);
  EXPECT_GE(Clock::now() - start, kDeadline - milliseconds(1));  // counted in whole ones
  EXPECT_LT(Clock::now() - start, 2 * kDeadline);
}

TEST(ConnectAttemptTest, TheNameAndTheHandshakeHaveOneDeadline) {
  GatedResolver resolver;
  const TestPeer peer([](PeerSocket& socket) { socket.Drain(); });
  ConnectionOptions options = peer.options();
  options.endpoint.host = "daemon";
  options.names = std::make_shared<NameLookup>(resolver.resolver());
  options.connect_timeout = kDeadline;
  const Clock::time_point start = Clock::now();
  ConnectAttempt attempt(options);
  const ConnectProgress half = attempt.Continue(kDeadline * 2 / 3);
  EXPECT_TRUE(half.failure.ok()) << half.failure.message();
  resolver.Answer(NameLookup::Addresses{"127.0.0.1"});
  const ConnectProgress progress = attempt.Continue(kLong);
  EXPECT_EQ(progress.failure.code(), StatusCode::kTimeout) << progress.failure.message();
  EXPECT_LT(Clock::now() - start, kDeadline * 3 / 2);
}

TEST(ConnectAttemptTest, ANameThatNobodyAnswersForHoldsNoCall) {
  GatedResolver resolver;
  ConnectionOptions options;
  options.endpoint.host = "daemon";
  options.names = std::make_shared<NameLookup>(resolver.resolver());
  options.connect_timeout = kDeadline;
  Clock::time_point start = Clock::now();
  {
    ConnectAttempt attempt(options);
    EXPECT_TRUE(attempt.Continue(milliseconds(1)).failure.ok());
    const ConnectProgress progress = attempt.Continue(kLong);
    EXPECT_EQ(progress.failure.code(), StatusCode::kTimeout);
    EXPECT_NE(progress.failure.message().find("resolving"), std::string::npos);
  }
  EXPECT_LT(Clock::now() - start, 2 * kDeadline);
  start = Clock::now();
  const auto client = AtlasClient::Connect(options);
  EXPECT_EQ(client.error().code(), StatusCode::kTimeout);
  EXPECT_LT(Clock::now() - start, 2 * kDeadline);
  EXPECT_EQ(resolver.asked().size(), 1U) << "the question of the first attempt is still open";
}

TEST(ConnectAttemptTest, AHostWithAnAddressThatIsDeadIsReachedAtTheNextOne) {
  GatedResolver resolver;
  const TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    socket.Drain();
  });
  ConnectionOptions options = peer.options();
  options.endpoint.host = "daemon";
  options.names = std::make_shared<NameLookup>(resolver.resolver());
  resolver.Answer(NameLookup::Addresses{"::1", "127.0.0.1"});
  EXPECT_TRUE(ToTheEnd(options).client);
  resolver.Answer(NameLookup::Addresses{"no address"});
  EXPECT_EQ(ToTheEnd(options).failure.code(), StatusCode::kUnavailable);
}

// Addresses that are not loopback's, and that nothing leaves the machine for.
TEST(ConnectAttemptTest, NothingGoesBeyondLoopbackInTheClear) {
  GatedResolver resolver;
  ConnectionOptions options;
  options.endpoint.host = "daemon";
  options.token = "secret";
  options.names = std::make_shared<NameLookup>(resolver.resolver());
  for (const NameLookup::Addresses& addresses :
       {NameLookup::Addresses{"0.0.0.0"}, NameLookup::Addresses{"127.0.0.1", "0.0.0.0"},
        NameLookup::Addresses{"::"}, NameLookup::Addresses{"224.0.0.1"},
        NameLookup::Addresses{"255.255.255.255"}}) {
    resolver.Answer(addresses);
    const ConnectProgress progress = ConnectAttempt(options).Continue(kLong);
    EXPECT_EQ(progress.failure.code(), StatusCode::kInvalidArgument) << addresses.back();
    EXPECT_TRUE(progress.is_final);
    for (const std::string& says :
         {addresses.back(), std::string("--tls-ca"), std::string("--allow-plaintext")}) {
      EXPECT_NE(progress.failure.message().find(says), std::string::npos)
          << progress.failure.message();
    }
  }
}

// The system takes 0.0.0.0 for this machine.
TEST(ConnectAttemptTest, BeyondLoopbackWithTlsOrWhereItIsAllowedItConnects) {
  const TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    socket.Drain();
  });
  ConnectionOptions options = peer.options();
  options.endpoint.host = "0.0.0.0";
  options.allow_plaintext = true;
  const ConnectProgress progress = ToTheEnd(options);
  EXPECT_TRUE(progress.client) << progress.failure.message();

  const TestPeer other([](PeerSocket& socket) { socket.Drain(); });
  ConnectionOptions encrypted = other.options();
  encrypted.endpoint.host = "0.0.0.0";
  encrypted.tls = ConnectionTls{"nowhere.pem", {}, {}, {}};
  const Status failure = ToTheEnd(encrypted).failure;
  EXPECT_NE(failure.message().find("nowhere.pem"), std::string::npos) << failure.message();
}

TEST(ConnectAttemptTest, AllThatIsLoopbackIsReachedInTheClear) {
  for (const std::string host : {"127.0.0.1", "localhost"}) {
    const TestPeer peer([](PeerSocket& socket) {
      AnswerHello(socket, {});
      socket.Drain();
    });
    ConnectionOptions options = peer.options();
    options.endpoint.host = host;
    const ConnectProgress progress = ToTheEnd(options);
    EXPECT_TRUE(progress.client) << progress.failure.message();
  }
  // Nobody listens there.
  for (const std::string host : {"127.3.2.1", "::1"}) {
    ConnectionOptions options;
    options.endpoint = {host, 1};
    EXPECT_EQ(ToTheEnd(options).failure.code(), StatusCode::kUnavailable) << host;
  }
}

// Somebody listens and takes nobody in: the system drops who comes, without a word.
TEST(ConnectAttemptTest, AHostWithAnAddressThatNeverAnswersIsReachedAtTheNextOne) {
  GatedResolver resolver;
  std::unique_ptr<TestPeer> peer;
  std::unique_ptr<SilentAddress> silent;
  for (int i = 0; i < 10 && (silent == nullptr || !silent->is_there()); ++i) {
    peer = std::make_unique<TestPeer>([](PeerSocket& socket) {
      AnswerHello(socket, {});
      socket.Drain();
    });
    silent = std::make_unique<SilentAddress>("127.0.0.2", peer->endpoint().port);
  }
  ASSERT_TRUE(silent->is_there());
  ConnectionOptions options = peer->options();
  options.endpoint.host = "daemon";
  options.names = std::make_shared<NameLookup>(resolver.resolver());
  resolver.Answer(NameLookup::Addresses{"127.0.0.2", "127.0.0.1"});
  const Clock::time_point start = Clock::now();
  const ConnectProgress progress = ToTheEnd(options);
  EXPECT_TRUE(progress.client) << progress.failure.message();
  EXPECT_GE(Clock::now() - start, options.connect_timeout / 3);
  resolver.Answer(NameLookup::Addresses{"127.0.0.2", "127.0.0.2"});
  EXPECT_EQ(ToTheEnd(options).failure.code(), StatusCode::kTimeout);
}

TEST(ConnectAttemptTest, WhatTheDaemonRefusesForGoodIsFinal) {
  for (const StatusCode code : {StatusCode::kInvalidData, StatusCode::kUnsupported}) {
    const ConnectProgress progress = Refused(code);
    EXPECT_EQ(progress.failure.code(), code);
    EXPECT_TRUE(progress.is_final) << StatusCodeName(code);
  }
  for (const StatusCode code : {StatusCode::kUnavailable, StatusCode::kPermissionDenied,
                                StatusCode::kInternal, StatusCode::kResourceExhausted}) {
    const ConnectProgress progress = Refused(code);
    EXPECT_EQ(progress.failure.code(), code);
    EXPECT_FALSE(progress.is_final) << StatusCodeName(code);
  }
}

TEST(ConnectAttemptTest, BytesThatMakeNoSenseAreNotFinal) {
  const std::string wrong_checksum("RAF1\1\0\0\0\0\0\0\0x", 13);
  const std::string portal = "HTTP/1.1 503 Service Unavailable\r\n\r\n";
  for (const std::string& text : {portal, wrong_checksum}) {
    const TestPeer peer([text](PeerSocket& socket) {
      socket.ReadRequest();
      socket.Write(BytesFromWire(text));
      socket.Drain();
    });
    const ConnectProgress progress = ToTheEnd(peer.options());
    EXPECT_EQ(progress.failure.code(), StatusCode::kInvalidData) << progress.failure.message();
    EXPECT_FALSE(progress.is_final);
  }
  // What the daemon says of a Hello that was damaged on its way.
  const ConnectProgress damaged = Refused(StatusCode::kInvalidData, true);
  EXPECT_EQ(damaged.failure.code(), StatusCode::kInvalidData);
  EXPECT_FALSE(damaged.is_final);
}

TEST(ConnectAttemptTest, TheHandshakeSaysHowFarASessionIsThere) {
  std::vector<wire::Hello> hellos;
  const auto connect = [&hellos](std::optional<SessionKey> resume,
                                 std::optional<std::uint32_t> last_sequence) {
    const TestPeer peer([&hellos, last_sequence](PeerSocket& socket) {
      const auto request = socket.ReadRequest();
      hellos.push_back(request->hello());
      wire::Envelope reply;
      wire::HelloReply& hello = *reply.mutable_hello_reply();
      hello.set_protocol_major(kProtocolMajor);
      hello.set_profile(ProfileToWire({}));
      if (last_sequence) hello.set_last_sequence(*last_sequence);
      socket.Reply(request->request_id(), std::move(reply));
      socket.Drain();
    });
    ConnectionOptions options = peer.options();
    options.resume = std::move(resume);
    const auto client = AtlasClient::Connect(options);
    return client ? client->atlas().last_sequence : std::optional<std::uint32_t>(~0U);
  };
  EXPECT_EQ(connect(SessionKey{"car", "monday"}, 41U), 41U);
  EXPECT_EQ(connect(SessionKey{"car", "monday"}, 0U), 0U);
  EXPECT_EQ(connect(SessionKey{"car", "monday"}, std::nullopt), std::nullopt);
  EXPECT_EQ(connect(std::nullopt, std::nullopt), std::nullopt);
  EXPECT_EQ(hellos.at(0).resume().vehicle(), "car");
  EXPECT_EQ(hellos.at(0).resume().session(), "monday");
  EXPECT_FALSE(hellos.at(3).has_resume());
}

TEST(ConnectAttemptTest, AFileThatIsOfNoUseIsFinal) {
  const TestPeer peer([](PeerSocket& socket) { socket.Drain(); });
  ConnectionOptions options = peer.options();
  options.tls = ConnectionTls{"/nowhere/ca.pem", {}, {}, {}};
  const ConnectProgress progress = ToTheEnd(options);
  EXPECT_EQ(progress.failure.code(), StatusCode::kInvalidArgument) << progress.failure.message();
  EXPECT_TRUE(progress.is_final);
}

}  // namespace
}  // namespace atlas
