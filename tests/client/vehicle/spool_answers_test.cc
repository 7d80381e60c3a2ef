// What becomes of a keyframe that waits, by what the daemon says of it.
#include <fstream>

#include <gtest/gtest.h>

#include "tests/client/vehicle/spool_peer.h"

namespace atlas {
namespace {

TEST(SpoolAnswersTest, WhatIsRefusedForGoodIsSetAsideWithItsReason) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 5; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  UploadPeer peer({{1, {StatusCode::kConflict, "other content"}},
                   {3, {StatusCode::kInvalidData, "of another profile"}}});
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->acknowledged, 3U);
  EXPECT_EQ(report->set_aside, 2U);
  EXPECT_EQ(spool.waiting(), 0U);
  const auto refused = FilesOf(spool.refused_folder());
  ASSERT_EQ(refused.size(), 4U);
  std::string reason;
  std::getline(std::ifstream(refused[1]), reason);
  EXPECT_EQ(reason, "conflict: keyframe car/monday/1: other content");
  EXPECT_EQ(Reopen(spool, folder).waiting(), 0U);
}

// The daemon's clock has caught up with the vehicle's, which was fast.
TEST(SpoolAnswersTest, WhatWasRefusedIsSentWhenItIsPutBack) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  const std::uint64_t bytes = spool.waiting_bytes();
  const Status ahead(StatusCode::kInvalidData, "a time ahead of the daemon's clock");
  UploadPeer strict({{0, ahead}, {1, ahead}, {2, ahead}, {3, ahead}});
  ASSERT_TRUE(strict.Take(spool));
  UploadSpool again = Reopen(spool, folder);
  EXPECT_EQ(again.refused(), 4U);
  ASSERT_TRUE(PutOne(again, 4).ok());
  fs::remove(FilesOf(again.refused_folder()).at(2));  // a keyframe, not its reason
  EXPECT_EQ(*again.RetryRefused(), 3U);
  EXPECT_EQ(again.refused(), 0U);
  EXPECT_EQ(again.waiting(), 4U);
  EXPECT_EQ(again.waiting_bytes(), bytes);
  EXPECT_TRUE(FilesOf(again.refused_folder()).empty());
  EXPECT_EQ(*again.RetryRefused(), 0U);
  UploadPeer peer;
  ASSERT_TRUE(peer.Take(again));
  EXPECT_EQ(peer.came(), (std::vector<std::uint32_t>{0, 2, 3, 4}));
}

TEST(SpoolAnswersTest, WhatWasRefusedStaysWhereThereIsNoRoomForIt) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 2; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  const std::uint64_t bytes_of_one = spool.waiting_bytes() / 2;
  UploadPeer strict({{0, {StatusCode::kInvalidData, "no"}}, {1, {StatusCode::kInvalidData, "no"}}});
  ASSERT_TRUE(strict.Take(spool));
  UploadSpool small = Reopen(spool, folder, bytes_of_one);
  EXPECT_EQ(*small.RetryRefused(), 1U);
  EXPECT_EQ(small.refused(), 1U);
  EXPECT_EQ(small.RetryRefused().error().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(FilesOf(small.refused_folder()).size(), 2U);
}

TEST(SpoolAnswersTest, WhatMayPassLaterIsKept) {
  for (const StatusCode code : {StatusCode::kResourceExhausted, StatusCode::kUnavailable,
                                StatusCode::kInternal, StatusCode::kPermissionDenied}) {
    const TestFolder folder;
    UploadSpool spool = OpenSpool(folder);
    for (std::uint32_t i = 0; i < 3; ++i) {
      ASSERT_TRUE(PutOne(spool, i).ok());
    }
    UploadPeer full({{0, {code, "not now"}}, {1, {code, "not now"}}, {2, {code, "not now"}}});
    EXPECT_EQ(full.Take(spool).error().code(), code);
    EXPECT_EQ(spool.waiting(), 3U);
    UploadPeer peer;
    ASSERT_TRUE(peer.Take(spool));
    EXPECT_EQ(peer.came(), UpTo(3));
  }
}

// A vehicle that was given another certificate while keyframes waited.
TEST(SpoolAnswersTest, WhatIsOfAnotherNameStopsNoOther) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 20; ++i) {
    ASSERT_TRUE(PutOne(spool, i, 100, i < 18 ? "car" : "car.b").ok());
  }
  std::map<std::uint32_t, Status> refusals;
  for (std::uint32_t i = 0; i < 18; ++i) {
    refusals[i] = {StatusCode::kPermissionDenied, "may not upload for the vehicle car"};
  }
  UploadPeer peer(refusals, 1 << 30, {"car.b", "vehicle"});
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->set_aside, 18U);
  EXPECT_EQ(peer.came(), (std::vector<std::uint32_t>{18, 19}));
  EXPECT_EQ(spool.waiting(), 0U);
  EXPECT_EQ(*spool.RetryRefused(), 18U);
  // Who may not upload at all keeps them, whatever their names.
  UploadPeer reader(refusals, 1 << 30, {"car.b", "reader"});
  EXPECT_EQ(reader.Take(spool).error().code(), StatusCode::kPermissionDenied);
  EXPECT_EQ(spool.waiting(), 18U);
  UploadPeer old_name({}, 1 << 30, {"car", "vehicle"});
  EXPECT_TRUE(old_name.Take(spool));
  EXPECT_EQ(spool.waiting(), 0U);
}

TEST(SpoolAnswersTest, AKeyframeThatTheDaemonFailsAtStopsNoOther) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  std::uint32_t next = 0;
  while (next < 3) {
    ASSERT_TRUE(PutOne(spool, next++).ok());
  }
  for (int send = 0; send < 2; ++send) {
    UploadPeer peer({{1, {StatusCode::kInternal, "stumbles"}}});
    const auto report = peer.Take(spool);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->skipped, 1U);
    EXPECT_EQ(report->set_aside, 0U);
    EXPECT_EQ(report->problem.code(), StatusCode::kInternal);
    EXPECT_EQ(spool.waiting(), 1U);
    // Alone it says nothing of itself: the daemon may fail at all.
    UploadPeer alone({{1, {StatusCode::kInternal, "stumbles"}}});
    EXPECT_EQ(alone.Take(spool).error().code(), StatusCode::kInternal);
    EXPECT_EQ(spool.waiting(), 1U);
    ASSERT_TRUE(PutOne(spool, next++).ok());
  }
  UploadPeer peer({{1, {StatusCode::kInternal, "stumbles"}}});
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->set_aside, 1U);
  EXPECT_EQ(spool.waiting(), 0U);
  EXPECT_EQ(spool.refused(), 1U);
}

TEST(SpoolAnswersTest, ADaemonThatFailsAtEverythingIsNotSentEverything) {
  const TestFolder folder;
  SpoolOptions options;
  options.folder = folder.path();
  options.upload.max_in_flight = 1;
  UploadSpool spool = *UploadSpool::Open(options);
  std::map<std::uint32_t, Status> failures;
  for (std::uint32_t i = 0; i < 50; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
    failures[i] = {StatusCode::kInternal, "stumbles"};
  }
  UploadPeer peer(failures, 10);  // it would leave then
  EXPECT_EQ(peer.Take(spool).error().code(), StatusCode::kInternal);
  EXPECT_EQ(spool.waiting(), 50U);
}

// The answer that was lost with the link may have been a refusal: a number says nothing of that.
TEST(SpoolAnswersTest, WhatWasNotAnsweredIsSentAgainHoweverFarTheSessionIsThere) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  UploadPeer cut({}, 0);
  EXPECT_EQ(cut.Take(spool).error().code(), StatusCode::kUnavailable);
  EXPECT_EQ(spool.waiting(), 4U);
  std::vector<std::uint32_t> came;
  {
    TestPeer peer([&came](PeerSocket& socket) {
      const auto hello = socket.ReadRequest();
      wire::Envelope greeting;
      wire::HelloReply& reply = *greeting.mutable_hello_reply();
      reply.set_protocol_major(kProtocolMajor);
      reply.set_protocol_minor(kProtocolMinor);
      reply.set_profile(ProfileToWire({}));
      reply.set_last_sequence(3);
      socket.Reply(hello->request_id(), std::move(greeting));
      while (const auto request = socket.ReadRequest()) {
        came.push_back(request->upload_keyframe().key().sequence());
        wire::Envelope answer;
        answer.mutable_upload_reply()->set_duplicate(true);
        socket.Reply(request->request_id(), std::move(answer));
      }
    });
    ConnectionOptions options = peer.options();
    options.resume = SessionKey{"car", "monday"};
    auto client = AtlasClient::Connect(options);
    ASSERT_TRUE(client) << client.error().message();
    EXPECT_EQ(client->atlas().last_sequence, 3U);
    EXPECT_TRUE(spool.Send(*client));
  }
  EXPECT_EQ(came, UpTo(4));
  EXPECT_EQ(spool.waiting(), 0U);
}

TEST(SpoolAnswersTest, ADaemonThatWantsToBeLeftAloneIs) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  ASSERT_TRUE(PutOne(spool, 0).ok());
  ASSERT_TRUE(PutOne(spool, 1).ok());
  int requests = 0;
  {
    TestPeer full([&requests](PeerSocket& socket) {
      AnswerHello(socket, {});
      while (const auto request = socket.ReadRequest()) {
        if (++requests == 2) continue;  // not answered yet
        wire::Envelope reply;
        const Status why(StatusCode::kResourceExhausted, "a full disk");
        *reply.mutable_error() = ErrorToWire(why.WithRetryAfter(3'600'000));
        socket.Reply(request->request_id(), std::move(reply));
      }
    });
    auto client = AtlasClient::Connect(full.options());
    ASSERT_TRUE(client) << client.error().message();
    const auto first = spool.Send(*client, {.deadline = std::chrono::milliseconds(300)});
    EXPECT_EQ(first.error().code(), StatusCode::kResourceExhausted);
    EXPECT_EQ(first.error().retry_after_ms(), 3'600'000);
    EXPECT_EQ(client->retry_after_of_reads(), std::chrono::milliseconds(0));
    const auto again = spool.Send(*client);
    ASSERT_TRUE(again) << again.error().message();
    EXPECT_GT(again->retry_after, std::chrono::milliseconds(0));
    EXPECT_LE(again->retry_after, std::chrono::minutes(1)) << "what is believed";
    EXPECT_EQ(again->acknowledged, 0U);
    EXPECT_EQ(again->waiting, 2U);
    EXPECT_EQ(again->in_flight, 1U);
  }
  EXPECT_EQ(requests, 2);
  EXPECT_EQ(spool.waiting(), 2U);
}

TEST(SpoolAnswersTest, BehindARefusalNothingMoreIsSent) {
  const TestFolder folder;
  SpoolOptions options;
  options.folder = folder.path();
  options.upload.max_in_flight = 4;
  UploadSpool spool = *UploadSpool::Open(options);
  for (std::uint32_t i = 0; i < 100; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  UploadPeer peer({{0, {StatusCode::kUnavailable, "busy"}}});
  EXPECT_EQ(peer.Take(spool).error().code(), StatusCode::kUnavailable);
  EXPECT_LE(peer.came().size(), 8U) << "what was on its way";
}

}  // namespace
}  // namespace atlas
