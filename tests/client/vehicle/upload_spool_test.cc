// What was put is sent or waits, whatever the link, the daemon and the disk do.
#include "client/vehicle/upload_spool.h"

#include <fstream>
#include <mutex>

#include <gtest/gtest.h>

#include "proto/wire/convert.h"
#include "tests/client/support/test_peer.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

// A daemon that remembers the sequence numbers it took, refuses as told, and leaves after so many.
class UploadPeer {
 public:
  explicit UploadPeer(std::map<std::uint32_t, Status> refusals = {}, int answers = 1 << 30)
      : refusals_(std::move(refusals)),
        answers_(answers),
        peer_([this](PeerSocket& socket) { Serve(socket); }) {}

  Result<SpoolReport> Take(UploadSpool& spool) {
    auto client = AtlasClient::Connect(peer_.options());
    return client ? spool.Send(*client) : Result<SpoolReport>(Error(client.error()));
  }
  std::vector<std::uint32_t> came() {
    const std::lock_guard lock(mutex_);
    return came_;
  }

 private:
  void Serve(PeerSocket& socket) {
    AnswerHello(socket, {});
    while (const auto request = socket.ReadRequest()) {
      if (answers_-- <= 0) return;
      const std::uint32_t sequence = request->upload_keyframe().key().sequence();
      wire::Envelope reply;
      const auto refusal = refusals_.find(sequence);
      if (refusal != refusals_.end()) {
        *reply.mutable_error() = ErrorToWire(refusal->second);
      } else {
        const std::lock_guard lock(mutex_);
        came_.push_back(sequence);
        reply.mutable_upload_reply()->set_revision(1);
      }
      socket.Reply(request->request_id(), std::move(reply));
    }
  }

  std::map<std::uint32_t, Status> refusals_;
  int answers_;
  std::mutex mutex_;
  std::vector<std::uint32_t> came_;
  TestPeer peer_;
};

Status PutOne(UploadSpool& spool, std::uint32_t sequence, std::size_t bytes = 100) {
  const Bytes blob(bytes, static_cast<std::uint8_t>(sequence));
  KeyframeUpload upload;
  upload.key = {{"car", "monday"}, sequence};
  upload.time_ms = 1'000 + sequence;
  upload.blob = blob;
  return spool.Put(upload);
}

UploadSpool OpenSpool(const TestFolder& folder, std::uint64_t max_bytes = 1U << 30U) {
  SpoolOptions options;
  options.folder = folder.path();
  options.max_bytes = max_bytes;
  return *UploadSpool::Open(options);
}

// As the next run of the program finds it.
UploadSpool Reopen(UploadSpool& spool,
                   const TestFolder& folder,
                   std::uint64_t max_bytes = 1U << 30U) {
  { const UploadSpool closed = std::move(spool); }
  return OpenSpool(folder, max_bytes);
}

std::vector<std::uint32_t> UpTo(std::uint32_t count) {
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < count; ++i) {
    numbers.push_back(i);
  }
  return numbers;
}

std::vector<fs::path> FilesOf(const fs::path& folder) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const bool is_lock = entry.path().filename() == "lock";
    if (entry.is_regular_file() && !is_lock) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

TEST(UploadSpoolTest, SendsInOrderAndForgets) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 20; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  UploadPeer peer;
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->acknowledged, 20U);
  EXPECT_EQ(peer.came(), UpTo(20));
  EXPECT_EQ(spool.waiting(), 0U);
  EXPECT_EQ(spool.waiting_bytes(), 0U);
  EXPECT_TRUE(FilesOf(folder.path()).empty());
}

// Keyframes whose answers were lost with the link come again.
TEST(UploadSpoolHourTest, AnHourWithoutALinkLosesNothing) {
  const TestFolder folder;
  constexpr std::uint32_t kKeyframes = 3'600;
  {
    UploadSpool spool = OpenSpool(folder);
    for (std::uint32_t i = 0; i < kKeyframes; ++i) {
      ASSERT_TRUE(PutOne(spool, i, 60'000).ok());
    }
  }
  UploadSpool spool = OpenSpool(folder);
  EXPECT_EQ(spool.waiting(), kKeyframes);
  UploadPeer cut({}, 1'000);
  EXPECT_EQ(cut.Take(spool).error().code(), StatusCode::kUnavailable);
  UploadSpool again = Reopen(spool, folder);
  EXPECT_GE(again.waiting(), kKeyframes - 1'000);
  const auto first = static_cast<std::uint32_t>(kKeyframes - again.waiting());
  UploadPeer peer;
  ASSERT_TRUE(peer.Take(again));
  EXPECT_EQ(cut.came(), UpTo(1'000));
  std::vector<std::uint32_t> came = UpTo(first);
  const auto rest = peer.came();
  came.insert(came.end(), rest.begin(), rest.end());
  EXPECT_EQ(came, UpTo(kKeyframes));
}

TEST(UploadSpoolTest, AFullSpoolTakesNothingAndLosesNothing) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder, 1'000);
  std::uint32_t taken = 0;
  Status status;
  while ((status = PutOne(spool, taken)).ok()) {
    ++taken;
  }
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_LE(spool.waiting_bytes(), 1'000U);
  EXPECT_EQ(FilesOf(folder.path()).size(), taken);
  UploadPeer peer;
  ASSERT_TRUE(peer.Take(spool));
  EXPECT_EQ(peer.came(), UpTo(taken));
  EXPECT_TRUE(PutOne(spool, taken).ok());
}

TEST(UploadSpoolTest, WhatIsRefusedForGoodIsSetAsideWithItsReason) {
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
TEST(UploadSpoolTest, WhatWasRefusedIsSentWhenItIsPutBack) {
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

TEST(UploadSpoolTest, WhatWasRefusedStaysWhereThereIsNoRoomForIt) {
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

TEST(UploadSpoolTest, WhatMayPassLaterIsKept) {
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

TEST(UploadSpoolTest, AKeyframeThatTheDaemonFailsAtStopsNoOther) {
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

TEST(UploadSpoolTest, ADaemonThatFailsAtEverythingIsNotSentEverything) {
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
TEST(UploadSpoolTest, WhatWasNotAnsweredIsSentAgainHoweverFarTheSessionIsThere) {
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

TEST(UploadSpoolTest, ADaemonThatWantsToBeLeftAloneIs) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  ASSERT_TRUE(PutOne(spool, 0).ok());
  int requests = 0;
  {
    TestPeer full([&requests](PeerSocket& socket) {
      AnswerHello(socket, {});
      while (const auto request = socket.ReadRequest()) {
        ++requests;
        wire::Envelope reply;
        *reply.mutable_error() = ErrorToWire({StatusCode::kResourceExhausted, "a full disk"});
        reply.mutable_error()->set_retry_after_ms(60'000);
        socket.Reply(request->request_id(), std::move(reply));
      }
    });
    auto client = AtlasClient::Connect(full.options());
    ASSERT_TRUE(client) << client.error().message();
    EXPECT_EQ(spool.Send(*client).error().code(), StatusCode::kResourceExhausted);
    const auto again = spool.Send(*client);
    ASSERT_TRUE(again) << again.error().message();
    EXPECT_GT(again->retry_after, std::chrono::milliseconds(0));
    EXPECT_EQ(again->acknowledged, 0U);
  }
  EXPECT_EQ(requests, 1);
  EXPECT_EQ(spool.waiting(), 1U);
}

TEST(UploadSpoolTest, WhatAKilledProgramLeavesIsPutInOrder) {
  const TestFolder folder;
  {
    UploadSpool spool = OpenSpool(folder);
    for (std::uint32_t i = 0; i < 6; ++i) {
      ASSERT_TRUE(PutOne(spool, i).ok());
    }
  }
  const auto files = FilesOf(folder.path());
  fs::resize_file(files[1], fs::file_size(files[1]) / 2);
  fs::resize_file(files[2], 0);
  std::fstream(files[3], std::ios::in | std::ios::out | std::ios::binary).seekp(60).put('?');
  fs::copy_file(files[0], folder.path() / "0000000000000009.keyframe");  // twice
  std::ofstream(folder.path() / "0000000000000010.keyframe") << "garbage";
  std::ofstream(folder.path() / "0000000000000011.keyframe.partial") << "half";
  std::ofstream(folder.path() / "notes") << "not ours";
  std::ofstream(folder.path() / "9999999999999999.keyframe") << "nor this";
  UploadSpool spool = OpenSpool(folder);
  EXPECT_FALSE(fs::exists(folder.path() / "0000000000000011.keyframe.partial"));
  ASSERT_TRUE(PutOne(spool, 6).ok());
  UploadPeer peer;
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(peer.came(), (std::vector<std::uint32_t>{0, 4, 5, 0, 6}));
  EXPECT_EQ(report->set_aside, 4U);
  EXPECT_EQ(spool.waiting(), 0U);
  EXPECT_TRUE(fs::exists(folder.path() / "notes"));
}

TEST(UploadSpoolTest, AFileThatVanishedIsToldAndTheOthersAreSent) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  fs::remove(FilesOf(folder.path()).at(1));
  UploadPeer peer;
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(peer.came(), (std::vector<std::uint32_t>{0, 2, 3}));
  EXPECT_EQ(report->vanished, 1U);
  EXPECT_EQ(report->problem.code(), StatusCode::kNotFound);
  EXPECT_EQ(spool.waiting(), 0U);
  EXPECT_EQ(spool.waiting_bytes(), 0U);
  EXPECT_TRUE(FilesOf(spool.refused_folder()).empty());
}

TEST(UploadSpoolTest, AFileThatIsTooLargeIsSetAsideAndTheOthersAreSent) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  fs::resize_file(FilesOf(folder.path()).at(0), std::uintmax_t{17} << 20);
  UploadPeer peer;
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(peer.came(), (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(report->set_aside, 1U);
  EXPECT_EQ(spool.waiting(), 0U);
  EXPECT_EQ(FilesOf(spool.refused_folder()).size(), 2U);
}

// Each file is tried again by the next Send.
TEST(UploadSpoolTest, AFileThatCannotBeReadWaitsAndTheOthersAreSent) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  const fs::path path = FilesOf(folder.path()).at(0);
  const fs::path elsewhere = folder.path() / "elsewhere";
  fs::rename(path, elsewhere);
  fs::create_directory(path);  // opens, and every read fails, as on a bad sector
  UploadPeer peer;
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(peer.came(), (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(report->skipped, 1U);
  EXPECT_FALSE(report->problem.ok());
  EXPECT_EQ(spool.waiting(), 1U);
  fs::remove(path);
  fs::rename(elsewhere, path);
  UploadPeer later;
  ASSERT_TRUE(later.Take(spool));
  EXPECT_EQ(later.came(), UpTo(1));
  EXPECT_EQ(spool.waiting(), 0U);
}

TEST(UploadSpoolTest, WhatCannotBeSetAsideWaitsAndTheOthersAreSent) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  fs::resize_file(FilesOf(folder.path()).at(0), 20);
  fs::remove(spool.refused_folder());
  std::ofstream(spool.refused_folder()) << "in the way";
  UploadPeer peer({{2, {StatusCode::kInvalidData, "of another profile"}}});
  const auto report = peer.Take(spool);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(peer.came(), (std::vector<std::uint32_t>{1, 3}));
  EXPECT_EQ(report->set_aside, 0U);
  EXPECT_EQ(report->skipped, 2U);
  EXPECT_FALSE(report->problem.ok());
  EXPECT_EQ(spool.waiting(), 2U);
}

// A file at every length that a write can stop at.
TEST(UploadSpoolTest, AFileCutAnywhereIsNeverSent) {
  const TestFolder folder;
  {
    UploadSpool spool = OpenSpool(folder);
    ASSERT_TRUE(PutOne(spool, 0, 30).ok());
  }
  const fs::path path = FilesOf(folder.path()).at(0);
  for (std::uintmax_t size = fs::file_size(path); size-- > 0;) {
    fs::resize_file(path, size);
    UploadSpool cut = OpenSpool(folder);
    UploadPeer peer;
    const auto report = peer.Take(cut);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->set_aside, 1U) << size;
    EXPECT_TRUE(peer.came().empty());
    fs::rename(cut.refused_folder() / path.filename(), path);
  }
}

}  // namespace
}  // namespace atlas
