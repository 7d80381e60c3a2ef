// What one peer takes of what all share leaves the others theirs: of a name, of an address.
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "core/base/str_cat.h"
#include "server/net/connection/peer_access.h"
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using boost::asio::ip::make_address;
using ::testing::HasSubstr;

constexpr const char* kTokens =  // "alice", "bob"
    "alice reader never 2bd806c97f0e00af1a1fc3328fa763a9269723c8db8fac4f93af71db186d6e90\n"
    "bob reader never 81b637d8fcd2c6da6359e6963113a1170de795e4b725b84d1e0b4cfd9ec58ce9\n";

class SharesTest : public NetTest {
 protected:
  using Clock = std::chrono::steady_clock;
  // A batch of each of a few connections, what is made of the atlas here being small.
  static constexpr double kSlackBytes = 200e3;

  void ServeAliceAndBob(unsigned workers) {
    security_.access = std::make_shared<const AccessControl>(
        TokenList::Parse(kTokens, "tokens").value(), Role::kAdmin);
    Serve(workers);
  }
  std::unique_ptr<BlockingPeer> ConnectAs(const std::string& token) const {
    auto peer = std::make_unique<BlockingPeer>(port_);
    EXPECT_TRUE(peer->Greet(kProtocolMajor, "", token).has_hello_reply());
    return peer;
  }
  static wire::Envelope WatchOf(std::uint64_t id) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    envelope.mutable_watch_request()->mutable_area()->mutable_disc()->set_radius_um(1'000'000);
    return envelope;
  }
  static wire::Envelope SyncOf(std::uint64_t id) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    envelope.mutable_sync_request()->mutable_area()->mutable_disc()->set_radius_um(1'000'000'000);
    return envelope;
  }
  // Looks until then; says when more was sent than a second's worth, what the time since `begin`
  // is worth, and what is made at a time.
  std::string MostSentUntil(Clock::time_point end, double bytes_per_s, Clock::time_point begin) {
    double sent = 0;
    double most = 0;
    while (Clock::now() < end) {
      const std::chrono::duration<double> passed = Clock::now() - begin;
      most = bytes_per_s * (1.0 + passed.count()) + kSlackBytes;
      sent = static_cast<double>(server_->ReadFigures().sent_bytes);
      if (sent > most) {
        return StrCat(sent, " bytes after ", passed.count(), " s, expected at most ", most);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return sent > most / 2 ? "" : StrCat("only ", sent, " bytes");
  }
  static wire::Envelope DigestOf(std::uint64_t id, std::uint32_t timeout_ms) {
    wire::Envelope envelope;
    envelope.set_request_id(id);
    envelope.mutable_digest_request()->set_timeout_ms(timeout_ms);
    return envelope;
  }
  wire::Envelope PastDigestOf(std::uint64_t id, std::uint32_t timeout_ms) const {
    wire::Envelope envelope = DigestOf(id, timeout_ms);
    envelope.mutable_digest_request()->set_at_revision(service_->revision());
    return envelope;
  }
  // Each takes some 10 ms: all of them are read long before the last one is answered.
  static constexpr std::uint64_t kMany = 60;
  void ServeDigests() {
    net_.max_works = 2 * kMany;
    net_.of_name.waits = kMany + 1;
    ServeAliceAndBob(0);
    UploadDrive(6);
  }
  // Returns when nearly all of them are read.
  void SendManyDigests(const BlockingPeer& peer) const {
    for (std::uint64_t id = 1; id <= kMany; ++id) {
      peer.Send(PastDigestOf(id, 60'000));
    }
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (server_->ReadFigures().in_flight < kMany - 10 &&
           std::chrono::steady_clock::now() < deadline) {
      std::this_thread::yield();
    }
  }
  static std::string ErrorOf(const std::optional<wire::Envelope>& reply) {
    EXPECT_EQ(CodeOf(reply), StatusCode::kUnavailable);
    return reply ? reply->error().message() : "";
  }
};

TEST_F(SharesTest, TheWaitsOfOneNameLeavePlacesForOthers) {
  net_.max_waits = 2;
  net_.of_name.waits = 1;
  ServeAliceAndBob(0);  // nothing is ever fused
  UploadDrive(1);
  const auto alice = ConnectAs("alice");
  const auto again = ConnectAs("alice");
  const auto bob = ConnectAs("bob");
  alice->Send(WaitOf(1, 60'000));
  alice->Send(WaitOf(2, 60'000));
  EXPECT_THAT(ErrorOf(alice->Receive()), HasSubstr("of alice"));
  again->Send(WaitOf(3, 60'000));
  EXPECT_THAT(ErrorOf(again->Receive()), HasSubstr("of alice"));
  bob->Send(WaitOf(4, 60'000));
  bob->Send(WaitOf(5, 60'000));
  const auto busy = bob->Receive();
  EXPECT_EQ(busy->request_id(), 5u) << "the first one has a place";
  EXPECT_THAT(ErrorOf(busy), HasSubstr("of bob"));
}

TEST_F(SharesTest, WhoReadsLeavesPlacesForWhoeverLooksAfterTheAtlas) {
  net_.max_waits = 1;
  net_.max_works = 4;   // of which one is kept
  ServeAliceAndBob(0);  // nothing is ever fused
  UploadDrive(1);
  const auto alice = ConnectAs("alice");
  alice->Send(WaitOf(1, 60'000));
  for (std::uint64_t id = 2; id <= 4; ++id) {
    alice->Send(DigestOf(id, 60'000));
  }
  alice->Send(StatusOf(5));
  EXPECT_EQ(alice->Receive()->request_id(), 5u);
  const auto bob = ConnectAs("bob");
  bob->Send(DigestOf(1, 60'000));
  EXPECT_THAT(ErrorOf(bob->Receive()), HasSubstr("3 digests"));
  const auto admin = Connect();
  admin->Send(PastDigestOf(1, 60'000));
  EXPECT_TRUE(admin->Receive()->has_digest_reply());
}

TEST_F(SharesTest, OneNamesDigestsOfThePastLeaveAThreadForOthers) {
  ServeDigests();
  const auto alice = ConnectAs("alice");
  const auto bob = ConnectAs("bob");
  SendManyDigests(*alice);
  bob->Send(PastDigestOf(1, 60'000));
  EXPECT_TRUE(bob->Receive()->has_digest_reply());
  EXPECT_GT(server_->ReadFigures().in_flight, kMany / 2) << "hers come one after the other";
}

TEST_F(SharesTest, WhoseTimeIsOverBeforeAThreadIsFreeIsTold) {
  ServeDigests();
  const auto alice = ConnectAs("alice");
  const auto again = ConnectAs("alice");
  SendManyDigests(*alice);
  again->Send(PastDigestOf(1, 5));
  EXPECT_EQ(CodeOf(again->Receive()), StatusCode::kTimeout);
  EXPECT_GT(server_->ReadFigures().in_flight, kMany / 2) << "those before it go on";
}

TEST_F(SharesTest, TheWatchesOfOneNameLeavePlacesForOthers) {
  net_.max_watches = 2;
  net_.of_name.watches = 1;
  ServeAliceAndBob(1);
  const auto alice = ConnectAs("alice");
  const auto again = ConnectAs("alice");
  const auto bob = ConnectAs("bob");
  alice->Send(WatchOf(1));
  EXPECT_TRUE(alice->Receive()->has_watch_event());
  again->Send(WatchOf(2));
  EXPECT_THAT(ErrorOf(again->Receive()), HasSubstr("of alice"));
  bob->Send(WatchOf(3));
  EXPECT_TRUE(bob->Receive()->has_watch_event());
}

TEST_F(SharesTest, WhoeverComesWithoutANameIsLimitedByHisAddress) {
  net_.is_loopback_limited = true;
  net_.of_name.connections = 2;
  Serve();
  const auto first = Connect();
  const auto second = Connect();
  BlockingPeer third(port_);
  const wire::Envelope reply = third.Greet();
  EXPECT_THAT(ErrorOf(reply), HasSubstr("of 127.0.0.1 without a name"));
  EXPECT_TRUE(third.IsClosed());
}

TEST_F(SharesTest, WhatANameIsSentHasARateAndOthersDoNotWaitForIt) {
  Serve();
  UploadDrive(6);
  Digest();
  StopServer();
  net_.of_name.served_bytes_per_s = 200e3;
  net_.of_name.requests_per_s = 0;
  ServeAliceAndBob(1);
  const auto alice = ConnectAs("alice");
  const auto again = ConnectAs("alice");
  const auto bob = ConnectAs("bob");
  std::size_t served_bytes = 0;
  const auto begin = std::chrono::steady_clock::now();
  for (std::uint64_t i = 1; served_bytes < 500'000; ++i) {
    const auto& peer = i % 2 == 0 ? alice : again;  // both are hers
    peer->Send(QueryOf(i));
    for (bool is_end = false; !is_end;) {
      std::size_t bytes = 0;
      const auto reply = peer->Receive(&bytes);
      ASSERT_TRUE(reply && !reply->has_error());
      served_bytes += bytes;
      is_end = !reply->has_tile();
    }
  }
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
  EXPECT_GT(passed.count(), 1.0);  // 2.5 s' worth, of which a second's comes at once
  const auto bobs = std::chrono::steady_clock::now();
  bob->Send(StatusOf(1));
  EXPECT_TRUE(bob->Receive()->has_status_reply());
  EXPECT_LT(std::chrono::steady_clock::now() - bobs, std::chrono::milliseconds(300));
}

// The most that one may have under way, on all connections; she reads none of it, so that nothing
// but the rate counts.
TEST_F(SharesTest, RepliesUnderWayKeepToTheRateOfTheirName) {
  constexpr double kBytesPerS = 200e3;
  Serve();
  UploadDrive(12);
  Digest();
  StopServer();
  net_.of_name.served_bytes_per_s = kBytesPerS;
  net_.of_name.requests_per_s = 0;
  ServeAliceAndBob(1);
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  const auto begin = Clock::now();
  for (int i = 0; i < 4; ++i) {
    peers.push_back(ConnectAs("alice"));
    for (std::uint64_t id = 1; id <= 60; ++id) {
      peers.back()->Send(id % 2 == 0 ? QueryOf(id) : SyncOf(id));
    }
  }
  EXPECT_EQ(MostSentUntil(begin + std::chrono::seconds(2), kBytesPerS, begin), "");
  // What is no such reply does not wait, on the same connection either, nor do others.
  const auto bob = ConnectAs("bob");
  const auto asked = Clock::now();
  bob->Send(SyncOf(1));
  peers[0]->Send(StatusOf(99));
  for (auto reply = bob->Receive(); !reply->has_sync_end(); reply = bob->Receive()) {
  }
  for (auto reply = peers[0]->Receive(); !reply->has_status_reply(); reply = peers[0]->Receive()) {
  }
  EXPECT_LT(Clock::now() - asked, std::chrono::milliseconds(500));
}

// What a name owes is no reason to be late then.
TEST_F(SharesTest, NobodyPausesWhileTheServerStops) {
  Serve();
  UploadDrive(12);
  Digest();
  StopServer();
  net_.of_name.served_bytes_per_s = 20e3;
  ServeAliceAndBob(1);
  const auto alice = ConnectAs("alice");
  alice->Send(SyncOf(1));
  alice->Send(SyncOf(2));
  ASSERT_TRUE(alice->Receive()->has_sync_manifest());
  const auto latest = Clock::now() + std::chrono::seconds(30);
  while (server_->ReadFigures().in_flight < 2 && Clock::now() < latest) {
    std::this_thread::yield();  // what is not read yet is not answered any more
  }
  const auto begin = Clock::now();
  server_->Stop();
  int ends = 0;
  while (const auto reply = alice->Receive()) {
    ends += reply->has_sync_end() ? 1 : 0;
  }
  EXPECT_EQ(ends, 2);
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(2));
  EXPECT_TRUE(HasDrained());
}

TEST_F(SharesTest, OnThisMachineNobodyIsLimitedByHisAddress) {
  net_.of_name.connections = 1;
  Serve();
  const auto first = Connect();
  const auto second = Connect();
  ExpectServes();
}

TEST_F(SharesTest, AWaitForWhatIsThereTakesNoPlace) {
  net_.max_waits = 0;
  Serve();
  UploadDrive(1);
  Digest();
  const auto peer = Connect();
  wire::Envelope query = QueryOf(1);
  query.mutable_query_region()->set_wait_revision(service_->revision());
  query.mutable_query_region()->set_timeout_ms(60'000);
  peer->Send(query);
  EXPECT_TRUE(peer->Receive()->has_tile());
}

TEST(PeerAddressTest, AHouseOfIp6IsOne) {
  EXPECT_EQ(SharedAddress(make_address("192.0.2.7")), "192.0.2.7");
  EXPECT_EQ(SharedAddress(make_address("::ffff:192.0.2.7")), "192.0.2.7");
  EXPECT_EQ(SharedAddress(make_address("2001:db8:1:2:3:4:5:6")), "2001:db8:1:2::/64");
}

TEST(PeerAddressTest, LoopbackIsThisMachine) {
  for (const char* const address : {"127.0.0.1", "127.3.2.1", "::1", "::ffff:127.0.0.1"}) {
    EXPECT_TRUE(IsOfThisMachine(make_address(address))) << address;
  }
  EXPECT_FALSE(IsOfThisMachine(make_address("192.0.2.7")));
  EXPECT_FALSE(IsOfThisMachine(make_address("2001:db8::1")));
}

}  // namespace
}  // namespace atlas
