// Sessions retracted and restored, and the atlas as of earlier revisions, over a real socket.
#include <map>

#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using Action = wire::ChangeSession::Action;

class HistoryRequestTest : public NetTest {
 protected:
  static wire::Envelope ChangeOf(const std::string& session, Action action) {
    wire::Envelope envelope;
    envelope.set_request_id(5);
    wire::ChangeSession& change = *envelope.mutable_change_session();
    change.set_vehicle("bus");
    change.set_session(session);
    change.set_action(action);
    change.set_author("tester");
    return envelope;
  }
  static wire::Envelope DigestOf(std::uint64_t at_revision, std::uint32_t timeout_ms = 60'000) {
    wire::Envelope envelope;
    envelope.mutable_digest_request()->set_at_revision(at_revision);
    envelope.mutable_digest_request()->set_timeout_ms(timeout_ms);
    return envelope;
  }
  static wire::Envelope QueryAt(std::uint64_t at_revision, std::uint64_t budget_bytes = 0) {
    wire::Envelope envelope = QueryOf(9, budget_bytes);
    envelope.mutable_query_region()->set_at_revision(at_revision);
    envelope.mutable_query_region()->set_timeout_ms(60'000);
    return envelope;
  }
  // Tiles by key, and the end, of the query that is under way.
  static std::map<std::uint64_t, wire::TileMessage> Receive(BlockingPeer& peer,
                                                            wire::QueryEnd* end = nullptr) {
    std::map<std::uint64_t, wire::TileMessage> tiles;
    for (auto reply = peer.Receive(); reply; reply = peer.Receive()) {
      if (!reply->has_tile()) {
        EXPECT_TRUE(reply->has_query_end()) << reply->ShortDebugString();
        if (end != nullptr) {
          *end = reply->query_end();
        }
        return tiles;
      }
      tiles[reply->tile().key()] = reply->tile();
    }
    ADD_FAILURE() << "no end of the reply";
    return tiles;
  }
};

TEST_F(HistoryRequestTest, ASessionIsRetractedAndRestored) {
  Serve();
  UploadDrive(3);
  const AtlasDigest before = Digest();
  const auto peer = Connect();
  for (const bool is_first : {true, false}) {
    peer->Send(ChangeOf("day", wire::ChangeSession::RETRACT));
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply->has_change_session_reply()) << reply->ShortDebugString();
    EXPECT_EQ(reply->change_session_reply().changed(), is_first);
    EXPECT_EQ(reply->change_session_reply().state(), "retracted");
    EXPECT_EQ(reply->change_session_reply().tiles_marked() > 0, is_first);
  }
  EXPECT_EQ(Digest().tiles, 0u);
  wire::Envelope sessions;
  sessions.mutable_sessions_request();
  peer->Send(sessions);
  EXPECT_EQ(peer->Receive()->sessions_reply().sessions(0).state(), "retracted");
  peer->Send(ChangeOf("day", wire::ChangeSession::RESTORE));
  EXPECT_EQ(peer->Receive()->change_session_reply().state(), "live");
  EXPECT_EQ(Digest().sha256, before.sha256);
}

TEST_F(HistoryRequestTest, ASessionIsQuarantinedReleasedAndPurged) {
  Serve();
  UploadDrive(2);
  UploadRequest wild = DriveUpload(2);
  wild.pose.x_um += 5'000 * std::int64_t{1'000'000};
  ASSERT_TRUE(Upload(wild).has_value());
  const auto peer = Connect();
  const auto session = [&peer] {
    wire::Envelope sessions;
    sessions.mutable_sessions_request();
    peer->Send(sessions);
    return peer->Receive()->sessions_reply().sessions(0);
  };
  const auto quarantined = [&peer] {
    wire::Envelope status;
    status.mutable_status_request();
    peer->Send(status);
    return peer->Receive()->status_reply().quarantined();
  };
  EXPECT_EQ(session().state(), "quarantined");
  EXPECT_NE(session().reason().find("keyframe 1 to 2: "), std::string::npos);
  EXPECT_EQ(quarantined(), 1u);
  peer->Send(ChangeOf("day", wire::ChangeSession::RELEASE));
  EXPECT_EQ(peer->Receive()->change_session_reply().state(), "released");
  EXPECT_EQ(session().state(), "released");
  EXPECT_EQ(quarantined(), 0u);
  peer->Send(ChangeOf("day", wire::ChangeSession::PURGE));
  const auto purged = peer->Receive();
  EXPECT_EQ(purged->change_session_reply().state(), "purged");
  EXPECT_EQ(purged->change_session_reply().keyframes(), 3u);
  EXPECT_EQ(session().state(), "purged");
  peer->Send(ChangeOf("day", wire::ChangeSession::RESTORE));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kConflict);
  peer->Send(ChangeOf("", wire::ChangeSession::PURGE));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
  EXPECT_EQ(Digest().tiles, 0u);
}

TEST_F(HistoryRequestTest, AStagedSessionIsListedAndPublished) {
  Serve();
  UploadDrive(2);
  const AtlasDigest day = Digest();
  const auto peer = Connect();
  for (std::uint32_t i = 3; i < 6; ++i) {
    const UploadRequest upload = DriveUpload(i, "night");
    wire::Envelope request;
    wire::UploadKeyframe& message = *request.mutable_upload_keyframe();
    *message.mutable_key() = KeyToWire(upload.key);
    message.set_time_ms(upload.time_ms);
    *message.mutable_pose() = PoseToWire(upload.pose);
    message.set_blob(BytesToWire(upload.blob));
    message.set_staged(true);
    peer->Send(request);
    EXPECT_EQ(peer->Receive()->upload_reply().tiles_marked(), 0u);
  }
  EXPECT_EQ(Digest().sha256, day.sha256);
  wire::Envelope sessions;
  sessions.mutable_sessions_request();
  peer->Send(sessions);
  EXPECT_EQ(peer->Receive()->sessions_reply().sessions(1).state(), "staged");
  wire::Envelope keyframes;
  keyframes.mutable_keyframes_request()->set_vehicle("bus");
  keyframes.mutable_keyframes_request()->set_session("night");
  keyframes.mutable_keyframes_request()->set_limit(2);
  peer->Send(keyframes);
  const auto first = peer->Receive()->keyframes_reply();
  ASSERT_EQ(first.keyframes_size(), 2);
  EXPECT_TRUE(first.has_more());
  EXPECT_EQ(first.keyframes(1).sequence(), 4u);
  EXPECT_EQ(*PoseFromWire(first.keyframes(1).pose()), DriveUpload(4).pose);
  keyframes.mutable_keyframes_request()->set_after_sequence(4);
  peer->Send(keyframes);
  const auto rest = peer->Receive()->keyframes_reply();
  ASSERT_EQ(rest.keyframes_size(), 1);
  EXPECT_FALSE(rest.has_more());
  keyframes.mutable_keyframes_request()->set_session("dusk");
  peer->Send(keyframes);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kNotFound);
  keyframes.mutable_keyframes_request()->set_session("a/b");
  peer->Send(keyframes);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
  peer->Send(ChangeOf("night", wire::ChangeSession::PUBLISH));
  const auto published = peer->Receive()->change_session_reply();
  EXPECT_EQ(published.state(), "live");
  EXPECT_GT(published.tiles_marked(), 0u);
  EXPECT_NE(Digest().sha256, day.sha256);
}

TEST_F(HistoryRequestTest, BadSessionChangesAreTyped) {
  Serve();
  UploadDrive(1);
  const auto peer = Connect();
  const auto code = [&](const wire::Envelope& request) {
    peer->Send(request);
    return CodeOf(peer->Receive());
  };
  EXPECT_EQ(code(ChangeOf("dusk", wire::ChangeSession::RETRACT)), StatusCode::kNotFound);
  EXPECT_EQ(code(ChangeOf("a/b", wire::ChangeSession::RETRACT)), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(ChangeOf("day", wire::ChangeSession::NONE)), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(ChangeOf("day", static_cast<Action>(7))), StatusCode::kInvalidArgument);
  EXPECT_EQ(service_->ListSessions({}, 1'000)->at(0).state, SessionState::kLive);
}

TEST_F(HistoryRequestTest, AQueryOfThePastSendsItsTilesWithItsRevision) {
  Serve();
  UploadDrive(3);
  const std::uint64_t revision = Digest().revision;
  const auto peer = Connect();
  peer->Send(QueryOf(9));
  const auto was = Receive(*peer);
  UploadDrive(6);
  Digest();
  wire::QueryEnd end;
  peer->Send(QueryAt(revision));
  const auto past = Receive(*peer, &end);
  ASSERT_EQ(past.size(), was.size());
  for (const auto& [key, tile] : past) {
    EXPECT_EQ(tile.payload_hash(), was.at(key).payload_hash());
    EXPECT_EQ(tile.revision(), revision);
  }
  EXPECT_EQ(end.revision(), revision);
  EXPECT_EQ(end.tiles(), was.size());
  peer->Send(QueryAt(0));
  EXPECT_TRUE(Receive(*peer, &end).empty());
  EXPECT_EQ(end.revision(), 0u);
  peer->Send(QueryAt(revision, 3'000));
  EXPECT_LT(Receive(*peer, &end).size(), was.size());
  EXPECT_TRUE(end.truncated());
  EXPECT_LE(end.bytes(), 3'000u);
}

TEST_F(HistoryRequestTest, ADigestOfThePastIsWhatItWas) {
  Serve();
  UploadDrive(2);
  const AtlasDigest was = Digest();
  UploadDrive(5);
  const auto peer = Connect();
  peer->Send(DigestOf(was.revision));
  const auto reply = peer->Receive();
  ASSERT_TRUE(reply->has_digest_reply()) << reply->ShortDebugString();
  EXPECT_EQ(reply->digest_reply().sha256(), BytesToWire(was.sha256));
  EXPECT_EQ(reply->digest_reply().revision(), was.revision);
}

TEST_F(HistoryRequestTest, RevisionsToComeAndNoTimeAreTyped) {
  Serve();
  UploadDrive(2);
  Digest();
  const auto peer = Connect();
  peer->Send(DigestOf(1'000'000));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
  peer->Send(QueryAt(1'000'000));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument);
  peer->Send(DigestOf(2, 0));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kTimeout);
  wire::Envelope hasty = QueryAt(2);
  hasty.mutable_query_region()->clear_timeout_ms();
  peer->Send(hasty);
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kTimeout);
  ExpectServes();
}

TEST_F(HistoryRequestTest, RequestsForThePastTakePlaces) {
  net_.max_works = 0;
  Serve();
  UploadDrive(1);
  const auto peer = Connect();
  peer->Send(DigestOf(1));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kUnavailable);
  peer->Send(QueryAt(1));
  EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kUnavailable);
}

}  // namespace
}  // namespace atlas
