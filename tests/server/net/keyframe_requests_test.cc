// Keyframes read back over a socket, and batches of corrections with their conditions.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <sqlite3.h>

#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

constexpr std::uint32_t kDrive = 8;

// A reply to who reads keyframes.
struct KeyframesRead {
  std::vector<wire::KeyframeMessage> keyframes;
  std::uint64_t bytes = 0;  // of all frames
  wire::KeyframesEnd end;
  StatusCode refused = StatusCode::kOk;
};

class KeyframeRequestsTest : public NetTest {
 protected:
  static wire::Envelope ReadOf(std::uint64_t request_id,
                               std::optional<std::uint32_t> after = std::nullopt,
                               std::uint64_t budget_bytes = 0,
                               const std::string& session = "day") {
    wire::Envelope envelope;
    envelope.set_request_id(request_id);
    wire::ReadKeyframes& read = *envelope.mutable_read_keyframes();
    read.set_vehicle("bus");
    read.set_session(session);
    read.set_budget_bytes(budget_bytes);
    if (after) {
      read.set_after_sequence(*after);
    }
    return envelope;
  }
  static KeyframesRead Receive(BlockingPeer& peer, std::uint64_t request_id) {
    KeyframesRead read;
    while (true) {
      std::size_t size_bytes = 0;
      const auto reply = peer.Receive(&size_bytes);
      if (!reply || reply->request_id() != request_id) {
        ADD_FAILURE() << "no end of the reply";
        return read;
      }
      read.bytes += size_bytes;
      if (!reply->has_keyframe()) {
        read.refused = CodeOf(reply);
        read.end = reply->keyframes_end();
        EXPECT_TRUE(reply->has_error() || reply->has_keyframes_end());
        return read;
      }
      read.keyframes.push_back(reply->keyframe());
    }
  }
  static KeyframesRead Ask(BlockingPeer& peer, const wire::Envelope& request) {
    peer.Send(request);
    return Receive(peer, request.request_id());
  }
  // With blobs of that size, which are none.
  void PutLarge(std::uint32_t count, std::size_t blob_bytes) {
    for (std::uint32_t i = 0; i < count; ++i) {
      NewKeyframe keyframe = service_->CheckUpload(DriveUpload(i)).value();
      keyframe.blob.assign(blob_bytes, static_cast<std::uint8_t>(i));
      const auto put = Await<PutKeyframeResult>(
          [&](auto done) { store_->PutKeyframe(std::move(keyframe), std::move(done)); });
      ASSERT_TRUE(put.has_value()) << put.error().message();
    }
  }
  static wire::Envelope PosesOf(std::uint64_t request_id, double x_m, std::uint64_t if_revision) {
    wire::Envelope envelope;
    envelope.set_request_id(request_id);
    wire::UpdatePoses& poses = *envelope.mutable_update_poses();
    wire::PoseUpdate& update = *poses.add_updates();
    *update.mutable_key() = KeyToWire(DriveUpload(1).key);
    *update.mutable_pose() = PoseToWire(PoseOf({x_m, 0.0, 1.8, 3.0}));
    poses.set_if_revision(if_revision);
    return envelope;
  }
};

TEST_F(KeyframeRequestsTest, TheyComeAsTheyWereUploadedWhereTheyAreNow) {
  Serve(0);
  const auto peer = Connect();
  for (std::uint32_t i = 0; i < kDrive; ++i) {
    wire::Envelope upload = UploadOf(i, 10 + i);
    if (i == 2) {
      wire::PositionPrior& prior = *upload.mutable_upload_keyframe()->mutable_prior();
      prior.set_x_um(-1'000'000);
      prior.set_y_um(2);
      prior.set_z_um(3'000'000'000);
      prior.set_radius_mm(1'500);
    }
    peer->Send(upload);
    ASSERT_TRUE(peer->Receive()->has_upload_reply());
  }
  const QuantizedPose moved = PoseOf({7.0, 1.0, 1.8, 3.0});
  ASSERT_TRUE(Move({{DriveUpload(1).key, moved}}).has_value());
  const KeyframesRead read = Ask(*peer, ReadOf(5));
  ASSERT_EQ(read.keyframes.size(), kDrive);
  EXPECT_EQ(read.end.keyframes(), kDrive);
  EXPECT_EQ(read.end.bytes(), read.bytes);
  EXPECT_EQ(read.end.revision(), service_->revision());
  EXPECT_FALSE(read.end.has_more());
  for (std::uint32_t i = 0; i < kDrive; ++i) {
    const wire::KeyframeMessage& keyframe = read.keyframes[i];
    const UploadRequest uploaded = DriveUpload(i);
    EXPECT_EQ(keyframe.sequence(), i);
    EXPECT_EQ(keyframe.time_ms(), uploaded.time_ms);
    EXPECT_EQ(keyframe.blob(), BytesToWire(uploaded.blob));
    EXPECT_EQ(PoseFromWire(keyframe.pose()).value(), i == 1 ? moved : uploaded.pose);
    EXPECT_EQ(keyframe.has_prior(), i == 2);
    EXPECT_TRUE(keyframe.damage().empty());
  }
  EXPECT_EQ(read.keyframes[2].prior().x_um(), -1'000'000);
  EXPECT_EQ(read.keyframes[2].prior().z_um(), 3'000'000'000);
  EXPECT_EQ(read.keyframes[2].prior().radius_mm(), 1'500U);
  EXPECT_EQ(Ask(*peer, ReadOf(6, 5)).keyframes.size(), 2U) << "behind the sixth";
  EXPECT_EQ(Ask(*peer, ReadOf(7, 100)).end.keyframes(), 0U);
}

TEST_F(KeyframeRequestsTest, ABudgetIsKeptAndTheRestComesBehindIt) {
  Serve(0);
  UploadDrive(kDrive);
  const auto peer = Connect();
  const std::uint64_t whole = Ask(*peer, ReadOf(4)).bytes;
  for (const std::uint64_t budget : {64UL, 400UL, whole / 3, whole / 2, whole - 1, whole + 4'000}) {
    std::optional<std::uint32_t> last;
    std::uint32_t came = 0;
    bool has_more = true;
    while (has_more) {
      const KeyframesRead part = Ask(*peer, ReadOf(5, last, budget));
      EXPECT_EQ(part.end.bytes(), part.bytes);
      EXPECT_LE(part.bytes, budget);
      came += part.end.keyframes();
      has_more = part.end.has_more();
      if (part.keyframes.empty()) {
        break;  // no room for one
      }
      last = part.keyframes.back().sequence();
    }
    EXPECT_EQ(came, budget < whole / 3 ? 0U : kDrive) << budget;
    EXPECT_EQ(has_more, budget < whole / 3);
  }
  EXPECT_EQ(Ask(*peer, ReadOf(6, std::nullopt, 63)).refused, StatusCode::kInvalidArgument);
}

TEST_F(KeyframeRequestsTest, DamagedOnesAreToldAndTheOthersCome) {
  Serve(0);
  PutLarge(4, 10'000);
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((directory_ / "data" / "atlas.db").c_str(), &db), SQLITE_OK);
  sqlite3_busy_timeout(db, 10'000);
  EXPECT_EQ(sqlite3_exec(db, "UPDATE keyframes SET blob = zeroblob(10000) WHERE sequence = 2",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(db);
  const auto peer = Connect();
  const KeyframesRead read = Ask(*peer, ReadOf(5));
  ASSERT_EQ(read.keyframes.size(), 4U);
  EXPECT_EQ(read.end.keyframes(), 4U);
  EXPECT_NE(read.keyframes[2].damage().find("wrong checksum"), std::string::npos);
  EXPECT_EQ(read.keyframes[2].sequence(), 2U);
  EXPECT_FALSE(read.keyframes[2].has_pose());
  EXPECT_TRUE(read.keyframes[2].blob().empty());
  EXPECT_EQ(read.keyframes[3].blob(), std::string(10'000, '\3'));
}

TEST_F(KeyframeRequestsTest, WhoAsksForNoSessionIsRefused) {
  Serve(0);
  const auto peer = Connect();
  EXPECT_EQ(Ask(*peer, ReadOf(5)).refused, StatusCode::kNotFound);
  EXPECT_EQ(Ask(*peer, ReadOf(6, std::nullopt, 0, "a b")).refused, StatusCode::kInvalidArgument);
  ExpectServes();
}

TEST_F(KeyframeRequestsTest, LargeOnesComeOneByOne) {
  constexpr std::size_t kLarge = 3u << 20;
  Serve(0);
  PutLarge(3, kLarge);
  const auto peer = Connect();
  const KeyframesRead read = Ask(*peer, ReadOf(5));
  ASSERT_EQ(read.keyframes.size(), 3U);
  for (std::uint32_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read.keyframes[i].blob(), std::string(kLarge, static_cast<char>(i)));
  }
  const KeyframesRead one = Ask(*peer, ReadOf(6, std::nullopt, kLarge + 1'000));
  EXPECT_EQ(one.keyframes.size(), 1U);
  EXPECT_TRUE(one.end.has_more());
}

TEST_F(KeyframeRequestsTest, LargeOnesThatNobodyReadsTakeAPlaceEach) {
  constexpr std::size_t kPeers = 12;
  net_.max_works = 8;
  Serve(0);
  PutLarge(2, 4u << 20);
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  for (std::size_t i = 0; i < kPeers; ++i) {
    peers.push_back(Connect(4'096));
    peers.back()->Send(ReadOf(5));
  }
  // Whoever has a place keeps it until it is read from, so nobody is before all have been answered.
  const auto refused_of = [](const NetFigures& figures) {
    return figures.kinds[static_cast<std::size_t>(RequestKind::kReadKeyframes)]
        .requests[static_cast<std::size_t>(StatusCode::kUnavailable)];
  };
  ExpectFigure(refused_of, kPeers - net_.max_works);
  std::size_t refused = 0;
  std::size_t first_came = 0;
  for (const auto& peer : peers) {
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply.has_value());
    refused += CodeOf(reply) == StatusCode::kUnavailable ? 1U : 0U;
    first_came += reply->has_keyframe() ? 1U : 0U;
  }
  EXPECT_EQ(refused, kPeers - net_.max_works);
  EXPECT_EQ(first_came, net_.max_works);
  ExpectServes();
}

TEST_F(KeyframeRequestsTest, RepliesThatNobodyReadsStayWithinWhatAllMayQueue) {
  constexpr std::size_t kPeers = 20;
  constexpr std::size_t kBlob = 20'000;
  net_.max_all_queued_bytes = 512u << 10;
  Serve(0);
  PutLarge(30, kBlob);
  Bytes requests;
  for (std::uint64_t id = 1; id <= 16; ++id) {
    const Bytes frame = EncodeEnvelopeFrame(ReadOf(id)).value();
    requests.insert(requests.end(), frame.begin(), frame.end());
  }
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  for (std::size_t i = 0; i < kPeers; ++i) {
    peers.push_back(Connect(4'096));
    peers.back()->SendBytes(requests);
  }
  const std::uint64_t expected = net_.max_all_queued_bytes / 8;
  const std::uint64_t most = WaitUntilAtRest({.more_than = expected}).most;
  EXPECT_GT(most, expected);
  EXPECT_LE(most, net_.max_all_queued_bytes + kPeers * (kBlob + 1'000));
  const auto good = Connect();
  EXPECT_EQ(Ask(*good, ReadOf(5)).keyframes.size(), 30U) << "who reads gets them all";
}

TEST_F(KeyframeRequestsTest, OtherKindsOfRepliesWaitForTheirTurn) {
  Serve(0);
  UploadDrive(kDrive);
  const auto peer = Connect();
  Bytes requests;
  for (const wire::Envelope& request : {ReadOf(1), QueryOf(2), ReadOf(3, 6)}) {
    const Bytes frame = EncodeEnvelopeFrame(request).value();
    requests.insert(requests.end(), frame.begin(), frame.end());
  }
  peer->SendBytes(requests);
  EXPECT_EQ(Receive(*peer, 1).keyframes.size(), kDrive);
  EXPECT_TRUE(peer->Receive()->has_query_end());
  EXPECT_EQ(Receive(*peer, 3).keyframes.size(), 1U);
}

TEST_F(KeyframeRequestsTest, ABatchIsAppliedOnItsConditionAndUndone) {
  Serve(0);
  UploadDrive(kDrive);
  const std::uint64_t computed_at = service_->revision();
  const auto peer = Connect();
  peer->Send(PosesOf(5, 9.0, computed_at));
  const auto applied = peer->Receive();
  ASSERT_TRUE(applied && applied->has_update_poses_reply()) << applied->ShortDebugString();
  EXPECT_EQ(applied->update_poses_reply().updated(), 1U);
  peer->Send(PosesOf(6, 12.0, computed_at));
  const auto refused = peer->Receive();
  EXPECT_EQ(CodeOf(refused), StatusCode::kConflict);
  EXPECT_FALSE(refused->error().retry()) << "not the same again";
  wire::Envelope undo;
  undo.set_request_id(7);
  undo.mutable_undo_poses()->set_batch(applied->update_poses_reply().batch());
  peer->Send(undo);
  const auto undone = peer->Receive();
  ASSERT_TRUE(undone && undone->has_update_poses_reply()) << undone->ShortDebugString();
  EXPECT_EQ(undone->update_poses_reply().updated(), 1U);
  EXPECT_EQ(undone->update_poses_reply().batch(), 2U);
  EXPECT_EQ(PoseFromWire(Ask(*peer, ReadOf(8)).keyframes[1].pose()).value(), DriveUpload(1).pose);
  peer->Send(undo);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kConflict);
}

TEST_F(KeyframeRequestsTest, ABatchPublishesAndSaysWhatBecameOfIt) {
  Serve(0);
  UploadDrive(2);
  UploadRequest night = DriveUpload(3, "night");
  night.is_staged = true;
  ASSERT_TRUE(Upload(std::move(night)).has_value());
  const auto peer = Connect();
  wire::Envelope batch = PosesOf(5, 9.0, service_->revision());
  wire::SessionName& name = *batch.mutable_update_poses()->add_publish();
  name.set_vehicle("bus");
  name.set_session("night");
  peer->Send(batch);
  const auto applied = peer->Receive();
  ASSERT_TRUE(applied && applied->has_update_poses_reply()) << applied->ShortDebugString();
  ASSERT_EQ(applied->update_poses_reply().sessions_size(), 1);
  EXPECT_EQ(applied->update_poses_reply().sessions(0).session(), "night");
  EXPECT_EQ(applied->update_poses_reply().sessions(0).state(), "live");
  wire::Envelope list;
  list.set_request_id(6);
  list.mutable_sessions_request()->set_changed(true);
  peer->Send(list);
  const auto sessions = peer->Receive();
  ASSERT_TRUE(sessions && sessions->sessions_reply().sessions_size() == 2);
  for (const wire::SessionInfo& session : sessions->sessions_reply().sessions()) {
    EXPECT_EQ(session.changed_revision(), applied->update_poses_reply().revision());
  }
  list.mutable_sessions_request()->set_changed(false);
  peer->Send(list);
  EXPECT_EQ(peer->Receive()->sessions_reply().sessions(0).changed_revision(), 0U);
}

}  // namespace
}  // namespace atlas
