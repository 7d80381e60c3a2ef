// The list of sessions comes in pages; who begins too many sessions has to wait.
#include <string>
#include <utility>
#include <vector>

#include <sqlite3.h>

#include "server/net/requests/sessions_reply.h"
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

constexpr std::uint32_t kMany = kMaxSessionsOfPage + 100;

class SessionsTest : public NetTest {
 protected:
  // Sessions of `vehicle`, each of one keyframe.
  void Begin(const std::string& vehicle, const std::vector<std::string>& sessions) {
    NewKeyframe keyframe = service_->CheckUpload(DriveUpload(0)).value();
    for (const std::string& session : sessions) {
      keyframe.key.session = {vehicle, session};
      service_->PutKeyframe(keyframe, [](const Result<PutKeyframeResult>& put) {
        EXPECT_TRUE(put.has_value()) << put.error().message();
      });
    }
    service_->Flush();
  }
  // With names as long as they may be.
  void BeginMany() {
    service_->set_sessions_per_hour(0);
    const std::string vehicle(kMaxNameSize, 'v');
    std::vector<std::string> sessions;
    for (std::uint32_t i = 0; i < kMany; ++i) {
      sessions.push_back(std::string(kMaxNameSize - 8, 's') + std::to_string(10'000'000 + i));
      if (sessions.size() == 1'000 || i + 1 == kMany) {  // as many writes as may queue, and more
        Begin(vehicle, std::exchange(sessions, {}));
      }
    }
  }
  static wire::Envelope SessionsOf(std::uint64_t request_id,
                                   const SessionKey& after = {},
                                   std::uint32_t limit = 0) {
    wire::Envelope envelope;
    envelope.set_request_id(request_id);
    wire::SessionsRequest& request = *envelope.mutable_sessions_request();
    request.set_after_vehicle(after.vehicle);
    request.set_after_session(after.session);
    request.set_limit(limit);
    return envelope;
  }
  struct Page {
    std::vector<std::string> names;
    bool has_more = false;

    friend bool operator==(const Page&, const Page&) = default;
  };
  static Page Ask(BlockingPeer& peer, const SessionKey& after, std::uint32_t limit) {
    peer.Send(SessionsOf(5, after, limit));
    const auto reply = peer.Receive();
    EXPECT_TRUE(reply && reply->has_sessions_reply());
    Page page;
    if (reply && reply->has_sessions_reply()) {
      for (const wire::SessionInfo& session : reply->sessions_reply().sessions()) {
        page.names.push_back(session.session());
      }
      page.has_more = reply->sessions_reply().has_more();
    }
    return page;
  }
};

TEST_F(SessionsTest, PagesFollowEachOther) {
  Serve(0);
  Begin("bus", {"a", "b", "c", "d", "e"});
  const auto peer = Connect();
  EXPECT_EQ(Ask(*peer, {}, 2), (Page{{"a", "b"}, true}));
  EXPECT_EQ(Ask(*peer, {"bus", "b"}, 2), (Page{{"c", "d"}, true}));
  EXPECT_EQ(Ask(*peer, {"bus", "d"}, 2), (Page{{"e"}, false}));
  EXPECT_EQ(Ask(*peer, {"bus", "e"}, 2), (Page{{}, false}));
  EXPECT_EQ(Ask(*peer, {}, 5), (Page{{"a", "b", "c", "d", "e"}, false})) << "the last one is full";
  EXPECT_EQ(Ask(*peer, {"bus", ""}, 1), (Page{{"a"}, true})) << "from this vehicle on";
  EXPECT_EQ(Ask(*peer, {"tram", ""}, 0), (Page{{}, false}));
}

TEST_F(SessionsTest, WhatBeginsOrVanishesBetweenPagesTakesNoOtherWithIt) {
  Serve(0);
  Begin("bus", {"b", "d", "f"});
  const auto peer = Connect();
  ASSERT_EQ(Ask(*peer, {}, 2), (Page{{"b", "d"}, true}));
  Begin("bus", {"a", "c", "e"});
  EXPECT_EQ(Ask(*peer, {"bus", "d"}, 2), (Page{{"e", "f"}, false}));
  EXPECT_EQ(Ask(*peer, {"bus", "d5"}, 2), (Page{{"e", "f"}, false})) << "as when it is gone";
}

TEST_F(SessionsTest, DamagedOnesAreMarkedAndTheOthersTold) {
  Serve(0);
  Begin("bus", {"a", "b", "c"});
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((directory_ / "data" / "atlas.db").c_str(), &db), SQLITE_OK);
  sqlite3_busy_timeout(db, 10'000);
  EXPECT_EQ(sqlite3_exec(db, "UPDATE sessions SET keyframes = 9 WHERE session IN ('b', 'c')",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(db);
  const auto peer = Connect();
  EXPECT_EQ(Ask(*peer, {}, 2), (Page{{"a", "b"}, true}));
  EXPECT_EQ(Ask(*peer, {"bus", "b"}, 2), (Page{{"c"}, false}));
  peer->Send(SessionsOf(6));
  const auto reply = peer->Receive();
  ASSERT_TRUE(reply && reply->sessions_reply().sessions_size() == 3);
  EXPECT_FALSE(reply->sessions_reply().sessions(0).damaged());
  EXPECT_EQ(reply->sessions_reply().sessions(0).state(), "live");
  const wire::SessionInfo& damaged = reply->sessions_reply().sessions(1);
  EXPECT_TRUE(damaged.damaged());
  EXPECT_EQ(damaged.state(), "damaged");
  EXPECT_EQ(damaged.keyframes(), 0u);
  EXPECT_NE(damaged.reason().find("wrong checksum"), std::string::npos) << damaged.reason();
}

TEST_F(SessionsTest, NamesThatAreNoneAreRefused) {
  Serve(0);
  const auto peer = Connect();
  for (const SessionKey& after : {SessionKey{"a b", ""}, {"", "a/b"}, {std::string(65, 'x'), ""}}) {
    peer->Send(SessionsOf(1, after));
    EXPECT_EQ(CodeOf(peer->Receive()), StatusCode::kInvalidArgument) << after;
  }
}

TEST_F(SessionsTest, WhoAsksForNoPageGetsTheFirstOne) {
  Serve(0);
  BeginMany();
  const auto peer = Connect();
  wire::Envelope older;
  older.set_request_id(1);
  older.mutable_sessions_request();
  for (const wire::Envelope& request : {older, SessionsOf(1, {}, kMany)}) {
    peer->Send(request);
    std::size_t size_bytes = 0;
    const auto reply = peer->Receive(&size_bytes);
    ASSERT_TRUE(reply && reply->has_sessions_reply());
    EXPECT_EQ(reply->sessions_reply().sessions_size(), int{kMaxSessionsOfPage});
    EXPECT_TRUE(reply->sessions_reply().has_more());
    EXPECT_LE(size_bytes, kReplyBatchBytes);
  }
}

TEST_F(SessionsTest, PagesThatNobodyReadsStayWithinWhatAllMayQueue) {
  constexpr std::size_t kPeers = 40;
  net_.max_all_queued_bytes = 512u << 10;
  Serve(0);
  BeginMany();
  Bytes requests;
  for (std::uint64_t id = 1; id <= 16; ++id) {
    const Bytes frame = EncodeEnvelopeFrame(SessionsOf(id)).value();
    requests.insert(requests.end(), frame.begin(), frame.end());
  }
  std::vector<std::unique_ptr<BlockingPeer>> peers;
  for (std::size_t i = 0; i < kPeers; ++i) {
    peers.push_back(Connect(4'096));
    peers.back()->SendBytes(requests);
  }
  const std::uint64_t expected = net_.max_all_queued_bytes / 4;
  const std::uint64_t most = WaitUntilAtRest({.more_than = expected}).most;
  EXPECT_GT(most, expected);
  EXPECT_LE(most, net_.max_all_queued_bytes + kPeers * 512);
  // Who reads gets them all, in smaller pages.
  const auto good = Connect();
  SessionKey after;
  std::size_t told = 0;
  for (bool has_more = true; has_more;) {
    const Page page = Ask(*good, after, 0);
    ASSERT_FALSE(page.names.empty());
    told += page.names.size();
    after = {std::string(kMaxNameSize, 'v'), page.names.back()};
    has_more = page.has_more;
  }
  EXPECT_EQ(told, kMany);
}

TEST_F(SessionsTest, AVehicleThatBeginsTooManyHasToWait) {
  Serve(0);
  service_->set_sessions_per_hour(3);
  const auto peer = Connect();
  const auto upload = [&peer](const SessionKey& session, std::uint32_t sequence) {
    UploadRequest request = DriveUpload(sequence);
    request.key.session = session;
    peer->Send(UploadOf(std::move(request), 9));
    return peer->Receive();
  };
  for (const char* const session : {"a", "b", "c"}) {
    EXPECT_TRUE(upload({"bus", session}, 0)->has_upload_reply()) << session;
  }
  const auto refused = upload({"bus", "d"}, 0);
  ASSERT_EQ(CodeOf(refused), StatusCode::kUnavailable);
  EXPECT_TRUE(refused->error().retry());
  // Until the next one may begin: 20 min after the first, which is a moment ago.
  EXPECT_GT(refused->error().retry_after_ms(), 18u * 60'000);
  EXPECT_LE(refused->error().retry_after_ms(), 20u * 60'000);
  EXPECT_EQ(CodeOf(upload({"bus", "d"}, 1)), StatusCode::kUnavailable) << "no gaps";
  EXPECT_TRUE(upload({"bus", "c"}, 1)->has_upload_reply()) << "one that was begun";
  EXPECT_TRUE(upload({"tram", "a"}, 0)->has_upload_reply()) << "another one, on this connection";
  service_->set_sessions_per_hour(0);
  EXPECT_TRUE(upload({"bus", "d"}, 0)->has_upload_reply());
  EXPECT_TRUE(upload({"bus", "d"}, 1)->has_upload_reply());
}

}  // namespace
}  // namespace atlas
