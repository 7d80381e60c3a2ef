#include "client/connection/keyframe_uploader.h"

#include <atomic>
#include <chrono>
#include <deque>
#include <thread>

#include <gtest/gtest.h>

#include "proto/wire/convert.h"
#include "tests/client/support/test_peer.h"

namespace atlas {
namespace {

void Acknowledge(PeerSocket& socket, std::uint64_t id, bool is_duplicate) {
  wire::Envelope reply;
  reply.mutable_upload_reply()->set_duplicate(is_duplicate);
  reply.mutable_upload_reply()->set_revision(id);
  reply.mutable_upload_reply()->set_tiles_marked(2);
  socket.Reply(id, std::move(reply));
}

KeyframeUpload Upload(std::uint32_t sequence, const Bytes& blob) {
  KeyframeUpload upload;
  upload.key = {{"car", "monday"}, sequence};
  upload.blob = blob;
  return upload;
}

TEST(KeyframeUploaderTest, APositionThatIsKnownGoesAlong) {
  std::vector<wire::UploadKeyframe> came;
  TestPeer peer([&](PeerSocket& socket) {
    AnswerHello(socket, {});
    for (int i = 0; i < 2; ++i) {
      const auto request = socket.ReadRequest();
      came.push_back(request->upload_keyframe());
      Acknowledge(socket, request->request_id(), false);
    }
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client);
  const Bytes blob(10, 1);
  KeyframeUpload upload = Upload(0, blob);
  ASSERT_TRUE(uploader.Upload(upload).ok());
  upload.key.sequence = 1;
  upload.prior = KnownPosition{-5, std::int64_t{1} << 40U, 7, 2'500};
  ASSERT_TRUE(uploader.Upload(upload).ok());
  ASSERT_TRUE(uploader.Finish().ok());
  ASSERT_EQ(came.size(), 2U);
  EXPECT_FALSE(came[0].has_prior());
  ASSERT_TRUE(came[1].has_prior());
  EXPECT_EQ(came[1].prior().x_um(), -5);
  EXPECT_EQ(came[1].prior().y_um(), std::int64_t{1} << 40U);
  EXPECT_EQ(came[1].prior().z_um(), 7);
  EXPECT_EQ(came[1].prior().radius_mm(), 2'500U);
}

TEST(KeyframeUploaderTest, KeepsTheWindowAndCountsEverything) {
  constexpr std::size_t kWindow = 4;
  constexpr std::uint32_t kUploads = 25;
  std::atomic<std::size_t> most_pending{0};
  TestPeer peer([&](PeerSocket& socket) {
    AnswerHello(socket, {});
    std::deque<std::uint64_t> pending;
    // Answers only when the window must be full, newest first: any order is allowed.
    for (std::uint32_t i = 0; i < kUploads; ++i) {
      pending.push_back(socket.ReadRequest()->request_id());
      most_pending = std::max(most_pending.load(), pending.size());
      if (pending.size() < kWindow) continue;
      Acknowledge(socket, pending.back(), i % 5 == 0);
      pending.pop_back();
    }
    for (const std::uint64_t id : pending) {
      Acknowledge(socket, id, false);
    }
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client, {.max_in_flight = kWindow});
  const Bytes blob(1000, 1);
  for (std::uint32_t i = 0; i < kUploads; ++i) {
    const Status status = uploader.Upload(Upload(i, blob));
    ASSERT_TRUE(status.ok()) << status.message();
  }
  ASSERT_TRUE(uploader.Finish().ok());
  EXPECT_EQ(uploader.totals().sent, kUploads);
  EXPECT_EQ(uploader.totals().acked, kUploads);
  EXPECT_EQ(uploader.totals().duplicates, 4U);
  EXPECT_EQ(uploader.totals().tiles_marked, 2U * kUploads);
  EXPECT_GT(uploader.totals().bytes_sent, 1000U * kUploads);
  EXPECT_EQ(most_pending, kWindow);
}

TEST(KeyframeUploaderTest, BytesBoundTheWindowToo) {
  TestPeer peer([&](PeerSocket& socket) {
    AnswerHello(socket, {});
    while (const auto request = socket.ReadRequest()) {
      Acknowledge(socket, request->request_id(), false);
    }
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client, {.max_in_flight = 64, .max_in_flight_bytes = 1500});
  const Bytes blob(1000, 1);
  for (std::uint32_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(uploader.Upload(Upload(i, blob)).ok());
    EXPECT_GE(uploader.totals().acked + 1, uploader.totals().sent);
  }
  EXPECT_TRUE(uploader.Finish().ok());
}

TEST(KeyframeUploaderTest, RefusalNamesItsKeyframeAndTheOthersAreCounted) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    for (int i = 0; i < 3; ++i) {
      const auto request = socket.ReadRequest();
      if (request->upload_keyframe().key().sequence() != 1) {
        Acknowledge(socket, request->request_id(), false);
        continue;
      }
      wire::Envelope reply;
      *reply.mutable_error() = ErrorToWire({StatusCode::kConflict, "other content"});
      socket.Reply(request->request_id(), std::move(reply));
    }
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client);
  for (std::uint32_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(uploader.Upload(Upload(i, Bytes(10))).ok());
  }
  const Status status = uploader.Finish();
  EXPECT_EQ(status.code(), StatusCode::kConflict);
  EXPECT_NE(status.message().find("car/monday/1"), std::string::npos) << status.message();
  EXPECT_EQ(uploader.totals().acked, 2U);
}

// Refuses a keyframe so often, and all behind it until it came (protocol.md, "UploadKeyframe").
void ServeBusy(PeerSocket& socket, std::uint32_t at, int times, std::vector<std::uint32_t>& taken) {
  AnswerHello(socket, {});
  while (const auto request = socket.ReadRequest()) {
    const std::uint32_t sequence = request->upload_keyframe().key().sequence();
    const bool is_missing = taken.size() <= at && sequence > at;
    if (is_missing || (sequence == at && times-- > 0)) {
      wire::Envelope reply;
      *reply.mutable_error() = ErrorToWire({StatusCode::kUnavailable, "busy"});
      reply.mutable_error()->set_retry_after_ms(20);
      socket.Reply(request->request_id(), std::move(reply));
    } else {
      taken.push_back(sequence);
      Acknowledge(socket, request->request_id(), false);
    }
  }
}

TEST(KeyframeUploaderTest, ABusyDaemonGetsAllOfThemInOrderInTheEnd) {
  constexpr std::uint32_t kCount = 40;
  for (const std::uint32_t at : {0U, 5U, kCount - 1}) {
    std::vector<std::uint32_t> taken;
    {
      TestPeer peer([&](PeerSocket& socket) { ServeBusy(socket, at, 3, taken); });
      auto client = AtlasClient::Connect(peer.options());
      ASSERT_TRUE(client);
      KeyframeUploader uploader(*client,
                                {.max_in_flight = 8, .patience = std::chrono::seconds(20)});
      for (std::uint32_t i = 0; i < kCount; ++i) {
        const Bytes blob(10, static_cast<std::uint8_t>(i));  // gone when it is sent again
        ASSERT_TRUE(uploader.Upload(Upload(i, blob)).ok());
      }
      const Status status = uploader.Finish();
      EXPECT_TRUE(status.ok()) << status.message();
      EXPECT_EQ(uploader.totals().acked, kCount);
    }
    ASSERT_EQ(taken.size(), kCount) << at;
    EXPECT_TRUE(std::is_sorted(taken.begin(), taken.end()));
  }
}

TEST(KeyframeUploaderTest, ALimitIsWaitedForAsLongAsItSays) {
  static constexpr std::chrono::milliseconds kWait{700};
  std::atomic<int> came{0};
  TestPeer peer([&came](PeerSocket& socket) {
    AnswerHello(socket, {});
    while (const auto request = socket.ReadRequest()) {
      if (++came > 1) {
        Acknowledge(socket, request->request_id(), false);
        continue;
      }
      wire::Envelope reply;
      const Status limit(StatusCode::kUnavailable, "too many sessions");
      *reply.mutable_error() = ErrorToWire(limit.WithRetryAfter(kWait.count()));
      socket.Reply(request->request_id(), std::move(reply));
    }
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client, {.patience = std::chrono::seconds(20)});
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE(uploader.Upload(Upload(0, Bytes(10))).ok());
  const Status status = uploader.Finish();
  EXPECT_TRUE(status.ok()) << status.message();
  EXPECT_GE(std::chrono::steady_clock::now() - start, kWait);
  EXPECT_EQ(came, 2);
}

TEST(KeyframeUploaderTest, PatienceHasAnEnd) {
  std::vector<std::uint32_t> taken;
  TestPeer peer([&](PeerSocket& socket) { ServeBusy(socket, 2, 1 << 30, taken); });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client, {.patience = std::chrono::milliseconds(300)});
  const auto start = std::chrono::steady_clock::now();
  for (std::uint32_t i = 0; i < 5; ++i) {
    ASSERT_TRUE(uploader.Upload(Upload(i, Bytes(10))).ok());
  }
  const Status status = uploader.Finish();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_NE(status.message().find("car/monday/2"), std::string::npos) << status.message();
  EXPECT_EQ(uploader.totals().acked, 2U);
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(300));
}

// The patience ends between two answers of one round: the keyframe that the others wait for is
// named, and sent once more.
TEST(KeyframeUploaderTest, WhoseTurnItIsIsNamedWhenPatienceEndsWithinARound) {
  std::atomic<int> refusals_of_the_first{0};
  TestPeer peer([&](PeerSocket& socket) {
    AnswerHello(socket, {});
    while (const auto request = socket.ReadRequest()) {
      const std::uint32_t sequence = request->upload_keyframe().key().sequence();
      if (sequence == 0) ++refusals_of_the_first;
      if (sequence == 1 && refusals_of_the_first == 1) {
        std::this_thread::sleep_for(std::chrono::seconds(3));
      }
      wire::Envelope reply;
      *reply.mutable_error() = ErrorToWire({StatusCode::kUnavailable, "busy"});
      reply.mutable_error()->set_retry_after_ms(1);
      socket.Reply(request->request_id(), std::move(reply));
    }
  });
  ConnectionOptions options = peer.options();
  options.request_timeout = std::chrono::seconds(60);
  auto client = AtlasClient::Connect(options);
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client, {.patience = std::chrono::seconds(2)});
  ASSERT_TRUE(uploader.Upload(Upload(0, Bytes(10))).ok());
  ASSERT_TRUE(uploader.Upload(Upload(1, Bytes(10))).ok());
  const Status status = uploader.Finish();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_NE(status.message().find("car/monday/0"), std::string::npos) << status.message();
  EXPECT_EQ(refusals_of_the_first, 2);
}

// As a daemon whose disk is full: what is behind a refused keyframe is refused for now.
TEST(KeyframeUploaderTest, ARefusalThatLastsEndsThePatienceWithThoseBehindIt) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    while (const auto request = socket.ReadRequest()) {
      const bool is_first = request->upload_keyframe().key().sequence() == 0;
      wire::Envelope reply;
      *reply.mutable_error() = ErrorToWire(
          is_first ? Status(StatusCode::kResourceExhausted, "the disk is full")
                   : Status(StatusCode::kUnavailable, "waits for keyframe car/monday/0"));
      socket.Reply(request->request_id(), std::move(reply));
    }
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client, {.max_in_flight = 3, .patience = std::chrono::hours(1)});
  Status status;
  for (std::uint32_t i = 0; i < 6 && status.ok(); ++i) {
    status = uploader.Upload(Upload(i, Bytes(10)));
  }
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(uploader.Finish().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(uploader.totals().acked, 0U);
}

TEST(KeyframeUploaderTest, RefusalThatNamesItsKeyframeIsNotNamedTwice) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    wire::Envelope reply;
    *reply.mutable_error() =
        ErrorToWire({StatusCode::kInvalidData, "keyframe car/monday/0: of another profile"});
    socket.Reply(socket.ReadRequest()->request_id(), std::move(reply));
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client);
  ASSERT_TRUE(uploader.Upload(Upload(0, Bytes(10))).ok());
  EXPECT_EQ(uploader.Finish().message(), "keyframe car/monday/0: of another profile");
}

TEST(KeyframeUploaderTest, LostConnectionIsNotAnAcknowledgement) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    Acknowledge(socket, socket.ReadRequest()->request_id(), false);
    socket.ReadRequest();
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  KeyframeUploader uploader(*client);
  ASSERT_TRUE(uploader.Upload(Upload(0, Bytes(10))).ok());
  ASSERT_TRUE(uploader.Upload(Upload(1, Bytes(10))).ok());
  EXPECT_EQ(uploader.Finish().code(), StatusCode::kUnavailable);
  EXPECT_EQ(uploader.totals().acked, 1U);
}

// Answers as a daemon of protocol 1.`minor`, whatever it is sent, and notes which uploads are
// staged.
std::vector<bool> StagedOnesThatCome(std::uint32_t minor, Status& second) {
  std::vector<bool> staged;
  {
    TestPeer peer([&staged, minor](PeerSocket& socket) {
      wire::Envelope hello;
      hello.mutable_hello_reply()->set_protocol_major(kProtocolMajor);
      hello.mutable_hello_reply()->set_protocol_minor(minor);
      hello.mutable_hello_reply()->set_profile(ProfileToWire({}));
      socket.Reply(socket.ReadRequest()->request_id(), std::move(hello));
      while (const auto request = socket.ReadRequest()) {
        staged.push_back(request->upload_keyframe().staged());
        Acknowledge(socket, request->request_id(), false);
      }
    });
    auto client = AtlasClient::Connect(peer.options());
    EXPECT_TRUE(client);
    KeyframeUploader uploader(*client);
    const Bytes blob(10, 1);
    EXPECT_TRUE(uploader.Upload(Upload(0, blob)).ok());
    KeyframeUpload upload = Upload(1, blob);
    upload.is_staged = true;
    second = uploader.Upload(upload);
    EXPECT_TRUE(uploader.Finish().ok());
  }
  return staged;
}

TEST(KeyframeUploaderTest, NothingIsStagedWithADaemonThatWouldTakeItIntoTheMap) {
  Status second;
  EXPECT_EQ(StagedOnesThatCome(10, second), (std::vector<bool>{false, true}));
  EXPECT_TRUE(second.ok());
  EXPECT_EQ(StagedOnesThatCome(9, second), (std::vector<bool>{false}));
  EXPECT_EQ(second.code(), StatusCode::kUnsupported);
}

}  // namespace
}  // namespace atlas
