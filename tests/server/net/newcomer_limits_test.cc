// Whoever connects and says nothing, or comes and goes, leaves places and turns to newcomers.
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Clock = std::chrono::steady_clock;
using From = BlockingPeer::From;

class NewcomerLimitTest : public NetTest {
 protected:
  std::vector<std::unique_ptr<BlockingPeer>> OpenSilent(int count, From from) const {
    std::vector<std::unique_ptr<BlockingPeer>> peers;
    for (int i = 0; i < count; ++i) {
      peers.push_back(std::make_unique<BlockingPeer>(port_, from));
    }
    return peers;
  }
  bool IsLetIn(From from) const {
    return BlockingPeer(port_, from).Greet().body_case() == wire::Envelope::kHelloReply;
  }
  // The server learns some time later that a peer has gone.
  void WaitUntilOnlyAreThere(std::uint64_t count) const {
    const auto deadline = Clock::now() + seconds(30);
    while (server_->ReadFigures().connections > count && Clock::now() < deadline) {
      std::this_thread::sleep_for(milliseconds(1));
    }
    EXPECT_EQ(server_->ReadFigures().connections, count);
  }
  void WaitUntilNobodyIsThere() const { WaitUntilOnlyAreThere(0); }
  // How long it takes until a good client has its answer.
  Clock::duration TimeToServe() const {
    const auto began = Clock::now();
    ExpectServes();
    return Clock::now() - began;
  }
};

TEST_F(NewcomerLimitTest, WhoeverSaysNothingLeavesPlacesToOtherAddresses) {
  net_.is_loopback_limited = true;
  net_.max_connections = 128;
  net_.handshake = seconds(60);
  Serve();
  const auto there = Connect();
  const auto silent = OpenSilent(300, {2});
  EXPECT_TRUE(IsLetIn({3}));
  EXPECT_TRUE(silent.back()->IsClosed());
  EXPECT_GT(server_->ReadFigures().refused, 200u);
  EXPECT_LE(server_->ReadFigures().connections, 10u);
  there->Send(StatusOf(1));
  EXPECT_TRUE(there->Receive()->has_status_reply());
}

TEST_F(NewcomerLimitTest, WhoSaidWhoHeIsIsNoNewcomer) {
  net_.is_loopback_limited = true;
  net_.max_connections = 64;  // of newcomers an address has three or four
  Serve();
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  for (int i = 0; i < 20; ++i) {
    peers.push_back(std::make_unique<BlockingPeer>(port_, From{2}));
    EXPECT_TRUE(peers.back()->Greet().has_hello_reply()) << i;
  }
}

TEST_F(NewcomerLimitTest, NewcomersHaveHalfOfThePlaces) {
  net_.max_connections = 8;
  net_.handshake = seconds(60);
  Serve();
  const auto first = Connect();
  const auto second = Connect();
  auto silent = OpenSilent(20, {1});
  EXPECT_TRUE(silent.back()->IsClosed());
  EXPECT_EQ(server_->ReadFigures().connections, 2u + 4u);
  silent.clear();
  WaitUntilOnlyAreThere(2);
  const auto third = Connect();
  ExpectServes();
}

TEST_F(NewcomerLimitTest, WhoComesAndGoesLeavesTheirTurnToOtherAddresses) {
  net_.is_loopback_limited = true;
  net_.clear_visits_per_s = 8;
  net_.address_share = 0.25;
  Serve();
  int let_in = 0;
  const auto began = Clock::now();
  for (int i = 0; i < 20; ++i) {
    let_in += IsLetIn({2}) ? 1 : 0;
    WaitUntilNobodyIsThere();
  }
  const std::chrono::duration<double> passed = Clock::now() - began;
  EXPECT_GE(let_in, 2);
  EXPECT_LE(let_in, 4 + static_cast<int>(2 * passed.count()));
  EXPECT_TRUE(IsLetIn({3}));
}

TEST_F(NewcomerLimitTest, WhoeverIsGoneIsNotWaitedFor) {
  net_.clear_visits_per_s = 1;
  Serve();
  for (int i = 0; i < 4; ++i) {  // two seconds of them are owed: a queue forms
    EXPECT_TRUE(IsLetIn({2}));
    WaitUntilNobodyIsThere();
  }
  OpenSilent(300, {2}).clear();
  EXPECT_LT(TimeToServe(), seconds(10)) << "not 0.1 s for each of them";
}

TEST_F(NewcomerLimitTest, WhoComesAndSaysSomethingIsWaitedFor) {
  net_.clear_visits_per_s = 1;
  Serve();
  const auto began = Clock::now();
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(IsLetIn({2}));
    WaitUntilNobodyIsThere();
  }
  EXPECT_GT(Clock::now() - began, milliseconds(500));
}

}  // namespace
}  // namespace atlas
