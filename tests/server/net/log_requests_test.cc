// What was done to the atlas, as peers are told.
#include "tests/server/net/tls_fixture.h"

namespace atlas {
namespace {

using LogRequestTest = NetTest;

wire::Envelope LogOf(std::uint64_t after_id, std::uint32_t limit = 0) {
  wire::Envelope envelope;
  envelope.set_request_id(3);
  envelope.mutable_log_request()->set_after_id(after_id);
  envelope.mutable_log_request()->set_limit(limit);
  return envelope;
}

TEST_F(LogRequestTest, EventsComeInOrderAndInPages) {
  Serve();
  UploadDrive(2);
  Digest();
  ASSERT_TRUE(Change("day", SessionAction::kRetract));
  ASSERT_TRUE(Change("day", SessionAction::kRestore));
  ASSERT_TRUE(Change("day", SessionAction::kRestore));  // changes nothing
  const auto peer = Connect();
  peer->Send(LogOf(0));
  const auto all = peer->Receive();
  ASSERT_TRUE(all->has_log_reply()) << all->ShortDebugString();
  ASSERT_EQ(all->log_reply().events_size(), 2);
  const wire::LogReply::Event& first = all->log_reply().events(0);
  EXPECT_EQ(first.id(), 1u);
  EXPECT_EQ(first.kind(), "retract");
  EXPECT_EQ(first.author(), "tester");
  EXPECT_EQ(first.subject(), "bus/day");
  EXPECT_GT(first.time_ms(), kTestNow_ms);
  EXPECT_EQ(all->log_reply().events(1).kind(), "restore");
  EXPECT_GT(all->log_reply().events(1).revision(), first.revision());
  peer->Send(LogOf(0, 1));
  EXPECT_EQ(peer->Receive()->log_reply().events_size(), 1);
  peer->Send(LogOf(1));
  EXPECT_EQ(peer->Receive()->log_reply().events(0).id(), 2u);
  peer->Send(LogOf(2));
  EXPECT_EQ(peer->Receive()->log_reply().events_size(), 0);
}

TEST_F(LogRequestTest, EventsThatNobodyReadsStayWithinWhatAllMayQueue) {
  constexpr std::size_t kPeers = 20;
  constexpr std::uint64_t kEvents = 700;  // 100 KB and more
  net_.max_all_queued_bytes = 256u << 10;
  Serve(0);
  ASSERT_TRUE(Upload(DriveUpload(0)));
  const std::string reason(256, 'r');
  for (std::uint64_t i = 0; i < kEvents; ++i) {
    const auto action = i % 2 == 0 ? SessionAction::kRetract : SessionAction::kRestore;
    service_->ChangeSession({{"bus", "day"}, action, "tester", reason}, [](const auto& changed) {
      EXPECT_TRUE(changed.has_value()) << changed.error().message();
    });
  }
  service_->Flush();
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  for (std::size_t i = 0; i < kPeers; ++i) {
    peers.push_back(Connect(4'096));
    for (int request = 0; request < 64; ++request) {
      peers.back()->Send(LogOf(0));
    }
  }
  const std::uint64_t expected = net_.max_all_queued_bytes / 4;
  const std::uint64_t most = WaitUntilAtRest({.more_than = expected}).most;
  EXPECT_GT(most, expected);
  EXPECT_LE(most, net_.max_all_queued_bytes + kPeers * 512);
  // Who reads gets them all.
  const auto good = Connect();
  std::uint64_t told = 0;
  while (true) {
    good->Send(LogOf(told));
    const auto reply = good->Receive();
    ASSERT_TRUE(reply && reply->has_log_reply());
    if (reply->log_reply().events().empty()) {
      break;
    }
    told = reply->log_reply().events().rbegin()->id();
  }
  EXPECT_EQ(told, kEvents);
}

// Whoever is known by a name cannot take another's.
TEST_F(TlsTest, TheLogNamesWhoeverIsKnown) {
  ServeTls("admin");
  ASSERT_TRUE(Upload(DriveUpload(0)));
  BlockingPeer alice(port_, Anonymous());
  alice.Greet(kProtocolMajor, "", "open sesame");
  wire::Envelope retraction = Retraction();
  retraction.mutable_change_session()->set_vehicle("bus");
  retraction.mutable_change_session()->set_session("day");
  retraction.mutable_change_session()->set_author("bob");
  ASSERT_EQ(Ask(alice, retraction), StatusCode::kOk);
  ASSERT_TRUE(alice.Send(LogOf(0)));
  EXPECT_EQ(alice.Receive()->log_reply().events(0).author(), "alice");
}

TEST_F(TlsTest, TheLogAndRepairsAreNotForAll) {
  ServeTls("reader");
  wire::Envelope repair = Verification();
  repair.mutable_verify_request()->set_repair(true);
  BlockingPeer alice(port_, Anonymous());
  alice.Greet(kProtocolMajor, "", "open sesame");
  EXPECT_EQ(Ask(alice, LogOf(0)), StatusCode::kPermissionDenied);
  EXPECT_EQ(Ask(alice, repair), StatusCode::kPermissionDenied);
  BlockingPeer merge(port_, As("aligner", "merge"));
  merge.Greet();
  EXPECT_EQ(Ask(merge, LogOf(0)), StatusCode::kOk);
  EXPECT_EQ(Ask(merge, repair), StatusCode::kPermissionDenied);
}

}  // namespace
}  // namespace atlas
