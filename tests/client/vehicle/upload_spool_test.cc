// What was put is sent or waits, whatever the link and the disk do.
#include "client/vehicle/upload_spool.h"

#include <fstream>

#include <gtest/gtest.h>

#include "client/vehicle/spooled_keyframe.h"
#include "client/vehicle/stored_file.h"
#include "tests/client/vehicle/spool_peer.h"

namespace atlas {
namespace {

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

// While it is on its way a folder that is not empty takes the place of its file.
TEST(UploadSpoolTest, WhatCannotBeDeletedIsToldNotSentAgainAndDeletedLater) {
  const TestFolder folder;
  UploadSpool spool = OpenSpool(folder);
  for (std::uint32_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(PutOne(spool, i).ok());
  }
  const fs::path path = FilesOf(folder.path()).at(1);
  std::vector<std::uint32_t> came;
  {
    TestPeer peer([&came, &path](PeerSocket& socket) {
      AnswerHello(socket, {});
      while (const auto request = socket.ReadRequest()) {
        came.push_back(request->upload_keyframe().key().sequence());
        if (came.back() == 1) {
          fs::remove(path);
          fs::create_directories(path / "in the way");
        }
        wire::Envelope reply;
        reply.mutable_upload_reply()->set_revision(1);
        socket.Reply(request->request_id(), std::move(reply));
      }
    });
    auto client = AtlasClient::Connect(peer.options());
    ASSERT_TRUE(client) << client.error().message();
    for (const std::uint64_t acknowledged : {2U, 0U}) {
      const auto report = spool.Send(*client);
      ASSERT_TRUE(report) << report.error().message();
      EXPECT_EQ(report->acknowledged, acknowledged);
      EXPECT_EQ(report->skipped, 1U);
      EXPECT_NE(report->problem.message().find(path.string()), std::string::npos);
      EXPECT_EQ(report->waiting, 1U);
      EXPECT_GT(spool.waiting_bytes(), 0U);
    }
    fs::remove(path / "in the way");
    const auto report = spool.Send(*client);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->acknowledged, 1U);
    EXPECT_TRUE(report->problem.ok());
    EXPECT_EQ(report->waiting, 0U);
  }
  EXPECT_EQ(came, UpTo(3));
  EXPECT_FALSE(fs::exists(path));
  EXPECT_EQ(spool.waiting_bytes(), 0U);
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

TEST(SpooledKeyframeTest, SaysWhetherItsSessionIsStaged) {
  const Bytes blob{1, 2, 3};
  KeyframeUpload upload;
  upload.key = {{"car", "monday"}, 4};
  upload.blob = blob;
  const Bytes live = EncodeSpooled(upload);
  upload.is_staged = true;
  const Bytes staged = EncodeSpooled(upload);
  EXPECT_EQ(live[4], 1) << "as programs before wrote it";
  EXPECT_EQ(staged[4], 2);
  EXPECT_FALSE(DecodeSpooled(live)->ToUpload().is_staged);
  EXPECT_TRUE(DecodeSpooled(staged)->ToUpload().is_staged);
  EXPECT_EQ(DecodeSpooled(staged)->blob, blob);
}

TEST(SpooledKeyframeTest, KeepsThePositionThatIsKnown) {
  const Bytes blob{1, 2, 3};
  KeyframeUpload upload;
  upload.key = {{"car", "monday"}, 4};
  upload.blob = blob;
  for (const bool is_staged : {false, true}) {
    upload.is_staged = is_staged;
    upload.prior = std::nullopt;
    const Bytes without = EncodeSpooled(upload);
    EXPECT_EQ(DecodeSpooled(without)->prior, std::nullopt);
    upload.prior = KnownPosition{-7, std::int64_t{1} << 40U, 5, 2'500};
    const Bytes with = EncodeSpooled(upload);
    EXPECT_EQ(with[4], without[4] + 2) << "a version of its own: others would lose it";
    EXPECT_EQ(with.size(), without.size() + 28);
    const auto read = DecodeSpooled(with);
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(read->ToUpload().prior, upload.prior);
    EXPECT_EQ(read->is_staged, is_staged);
    EXPECT_EQ(read->blob, blob);
  }
}

// As it was written before there were positions.
TEST(SpooledKeyframeTest, AnOldFileIsRead) {
  const Bytes content{0x52, 0x41, 0x56, 0x4B, 2, 3, 'c', 'a', 'r', 1, 'd', 9, 0, 0, 0};
  Bytes file = content;
  file.resize(file.size() + 8 + 3 * 8 + 4 * 4);
  file[content.size()] = 17;  // ms
  file.insert(file.end(), {2, 0, 0, 0, 0xAA, 0xBB});
  const auto read = DecodeSpooled(WithChecksum(std::move(file)));
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->key, (KeyframeKey{{"car", "d"}, 9}));
  EXPECT_EQ(read->time_ms, 17);
  EXPECT_TRUE(read->is_staged);
  EXPECT_EQ(read->prior, std::nullopt);
  EXPECT_EQ(read->blob, (Bytes{0xAA, 0xBB}));
}

TEST(SpooledKeyframeTest, WhatALaterProgramWroteIsNotGuessedAt) {
  KeyframeUpload upload;
  upload.key = {{"car", "monday"}, 4};
  Bytes file = EncodeSpooled(upload);
  file[4] = 5;
  file.resize(file.size() - 8);
  const auto read = DecodeSpooled(WithChecksum(std::move(file)));
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code(), StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
