// The client against peers that behave badly, and against one that behaves.
#include "client/connection/atlas_client.h"

#include <array>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "proto/wire/convert.h"
#include "tests/client/support/test_peer.h"

namespace atlas {
namespace {

StatusCode ConnectCode(std::function<void(PeerSocket&)> serve) {
  TestPeer peer(std::move(serve));
  const auto client = AtlasClient::Connect(peer.options());
  return client ? StatusCode::kOk : client.error().code();
}

TEST(AtlasClientTest, NobodyListensIsUnavailable) {
  Endpoint endpoint;
  {
    TestPeer peer([](PeerSocket&) {});
    endpoint = peer.endpoint();
  }
  ConnectionOptions options;
  options.endpoint = endpoint;
  const auto client = AtlasClient::Connect(options);
  ASSERT_FALSE(client);
  EXPECT_EQ(client.error().code(), StatusCode::kUnavailable);
  EXPECT_NE(client.error().message().find(endpoint.ToText()), std::string::npos);
}

TEST(AtlasClientTest, PeerThatClosesIsUnavailable) {
  EXPECT_EQ(ConnectCode([](PeerSocket& socket) { socket.ReadRequest(); }),
            StatusCode::kUnavailable);
}

TEST(AtlasClientTest, GarbageIsInvalidData) {
  EXPECT_EQ(ConnectCode([](PeerSocket& socket) {
              const std::string text = "HTTP/1.1 400 Bad Request\r\n\r\n";
              socket.Write(BytesFromWire(text));
              socket.Drain();
            }),
            StatusCode::kInvalidData);
}

TEST(AtlasClientTest, OversizedFrameIsRefusedWithoutReadingIt) {
  EXPECT_EQ(ConnectCode([](PeerSocket& socket) {
              ByteWriter header;
              header.Raw(Bytes{'R', 'A', 'F', '1'});
              header.U32(0xFFFFFFFF);
              header.U32(0);
              socket.Write(header.bytes());
              socket.Drain();
            }),
            StatusCode::kInvalidData);
}

TEST(AtlasClientTest, HalfAFrameIsTimeout) {
  EXPECT_EQ(ConnectCode([](PeerSocket& socket) {
              socket.Write(Bytes{'R', 'A', 'F', '1', 9});
              socket.Drain();
            }),
            StatusCode::kTimeout);
}

TEST(AtlasClientTest, AnotherMajorVersionIsUnsupported) {
  EXPECT_EQ(ConnectCode([](PeerSocket& socket) {
              wire::Envelope reply;
              reply.mutable_hello_reply()->set_protocol_major(2);
              socket.Reply(socket.ReadRequest()->request_id(), std::move(reply));
            }),
            StatusCode::kUnsupported);
}

TEST(AtlasClientTest, ReplyToARequestNeverSentIsInvalidData) {
  EXPECT_EQ(ConnectCode([](PeerSocket& socket) {
              socket.ReadRequest();
              wire::Envelope reply;
              reply.mutable_status_reply();
              socket.Reply(77, std::move(reply));
              socket.Drain();
            }),
            StatusCode::kInvalidData);
}

TEST(AtlasClientTest, DaemonsErrorKeepsItsCodeAndMessage) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    const auto request = socket.ReadRequest();
    wire::Envelope reply;
    *reply.mutable_error() = ErrorToWire({StatusCode::kConflict, "keyframe a/b/3 is another"});
    socket.Reply(request->request_id(), std::move(reply));
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  EXPECT_EQ(client->profile(), MapProfile{});
  EXPECT_EQ(client->atlas().revision, 7U);
  const auto status = client->ReadStatus();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code(), StatusCode::kConflict);
  EXPECT_EQ(status.error().message(), "keyframe a/b/3 is another");
}

// The system's own table: 02 is the timer of a connection that is probed when it is silent.
TEST(AtlasClientTest, ADaemonThatIsSilentIsProbed) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    socket.Drain();
  });
  const auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  std::array<char, 6> port{};
  std::snprintf(port.data(), port.size(), ":%04X", peer.endpoint().port);
  std::ifstream table("/proc/net/tcp");
  std::string timer;
  for (std::string line; timer.empty() && std::getline(table, line);) {
    std::istringstream fields(line);
    std::string number;
    std::string local;
    std::string remote;
    std::string state;
    std::string queues;
    std::string its_timer;
    fields >> number >> local >> remote >> state >> queues >> its_timer;
    if (remote.ends_with(port.data()) && state == "01") timer = its_timer.substr(0, 2);
  }
  EXPECT_EQ(timer, "02");
}

TEST(AtlasClientTest, LinkFailureStays) {
  TestPeer peer([](PeerSocket& socket) { AnswerHello(socket, {}); });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  ASSERT_FALSE(client->ReadStatus());
  const auto again = client->ListSessions();
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code(), StatusCode::kUnavailable);
}

// Answers requests for sessions with these pages, "vehicle/session" each; all but the last one have
// more behind them. Notes behind which one each was asked for.
struct Pages {
  std::vector<std::vector<SessionKey>> pages;
  bool has_more_at_last = false;
  std::vector<SessionKey> asked = {};

  void Serve(PeerSocket& socket) {
    AnswerHello(socket, {});
    for (std::size_t i = 0; i < pages.size(); ++i) {
      const auto request = socket.ReadRequest();
      if (!request) return;
      asked.push_back({request->sessions_request().after_vehicle(),
                       request->sessions_request().after_session()});
      wire::Envelope reply;
      wire::SessionsReply& page = *reply.mutable_sessions_reply();
      for (const SessionKey& key : pages[i]) {
        wire::SessionInfo& session = *page.add_sessions();
        session.set_vehicle(key.vehicle);
        session.set_session(key.session);
      }
      page.set_has_more(i + 1 < pages.size() || has_more_at_last);
      socket.Reply(request->request_id(), std::move(reply));
    }
  }
};

TEST(AtlasClientTest, SessionsAreAllOfTheirPages) {
  Pages pages{{{{"a", "1"}, {"a", "2"}}, {{"a", "3"}, {"b", "1"}}, {{"b", "2"}}}};
  {
    TestPeer peer([&pages](PeerSocket& socket) { pages.Serve(socket); });
    auto client = AtlasClient::Connect(peer.options());
    ASSERT_TRUE(client);
    const auto sessions = client->ListSessions();
    ASSERT_TRUE(sessions) << sessions.error().message();
    ASSERT_EQ(sessions->size(), 5U);
    EXPECT_EQ(sessions->back().key, (SessionKey{"b", "2"}));
  }
  EXPECT_EQ(pages.asked, (std::vector<SessionKey>{{}, {"a", "2"}, {"b", "1"}}));
}

TEST(AtlasClientTest, PagesOfSessionsThatNeverEndAreRefused) {
  for (Pages pages : {Pages{{{{"a", "1"}}, {{"a", "1"}}, {}}}, Pages{{{{"a", "2"}, {"a", "1"}}}},
                      Pages{{{{"a", "1"}}, {}}, true}}) {
    TestPeer peer([&pages](PeerSocket& socket) { pages.Serve(socket); });
    auto client = AtlasClient::Connect(peer.options());
    ASSERT_TRUE(client);
    const auto sessions = client->ListSessions();
    ASSERT_FALSE(sessions);
    EXPECT_EQ(sessions.error().code(), StatusCode::kInvalidData);
  }
}

void SendTile(PeerSocket& socket, std::uint64_t request_id, const TileId& id) {
  wire::Envelope reply;
  reply.mutable_tile()->set_key(id.Key());
  reply.mutable_tile()->set_blob("blob");
  socket.Reply(request_id, std::move(reply));
}

TEST(AtlasClientTest, QueryGivenUpLeavesTheConnectionUsable) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    const auto query = socket.ReadRequest();
    for (int x = 0; x < 3; ++x) {
      SendTile(socket, query->request_id(), {0, x, -1});
    }
    wire::Envelope end;
    end.mutable_query_end()->set_tiles(3);
    socket.Reply(query->request_id(), std::move(end));
    wire::Envelope status;
    status.mutable_status_reply()->set_tiles(42);
    socket.Reply(socket.ReadRequest()->request_id(), std::move(status));
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  int tiles = 0;
  const auto query = client->QueryRegion({}, [&tiles](const TileBlob& tile) {
    EXPECT_EQ(tile.id, (TileId{0, 0, -1}));
    ++tiles;
    return Status(StatusCode::kInvalidData, "enough");
  });
  ASSERT_FALSE(query);
  EXPECT_EQ(query.error().message(), "enough");
  EXPECT_EQ(tiles, 1);
  const auto status = client->ReadStatus();
  ASSERT_TRUE(status) << status.error().message();
  EXPECT_EQ(status->tiles, 42U);
}

TEST(AtlasClientTest, TileKeyThatNoTileHasIsInvalidData) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    const auto query = socket.ReadRequest();
    wire::Envelope reply;
    reply.mutable_tile()->set_key(~0ULL);
    socket.Reply(query->request_id(), std::move(reply));
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  const auto query = client->QueryRegion({}, [](const TileBlob&) { return Status(); });
  ASSERT_FALSE(query);
  EXPECT_EQ(query.error().code(), StatusCode::kInvalidData);
}

TEST(AtlasClientTest, WaitThatTimesOutIsTimeout) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    wire::Envelope reply;
    reply.mutable_wait_reply()->set_timed_out(true);
    reply.mutable_wait_reply()->set_dirty_tiles(5);
    socket.Reply(socket.ReadRequest()->request_id(), std::move(reply));
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  const auto wait = client->WaitUntilFused(std::chrono::milliseconds(10));
  ASSERT_FALSE(wait);
  EXPECT_EQ(wait.error().code(), StatusCode::kTimeout);
}

TEST(AtlasClientTest, AnOldDaemonIsNotAskedForThePast) {
  TestPeer peer([](PeerSocket& socket) {
    wire::Envelope hello;
    hello.mutable_hello_reply()->set_protocol_major(kProtocolMajor);
    hello.mutable_hello_reply()->set_protocol_minor(1);
    hello.mutable_hello_reply()->set_profile(ProfileToWire({}));
    socket.Reply(socket.ReadRequest()->request_id(), std::move(hello));
    socket.Drain();
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  const auto digest = client->Digest(std::chrono::milliseconds(10), 3);
  ASSERT_FALSE(digest);
  EXPECT_EQ(digest.error().code(), StatusCode::kUnsupported);
  RegionQuery query;
  query.at_revision = 3;
  EXPECT_EQ(client->QueryRegion(query, nullptr).error(), digest.error());
}

TEST(AtlasClientTest, AChangeSaysWhoAndWhy) {
  std::vector<std::string> asked;
  {
    TestPeer peer([&asked](PeerSocket& socket) {
      wire::Envelope hello;
      hello.mutable_hello_reply()->set_protocol_major(kProtocolMajor);
      hello.mutable_hello_reply()->set_protocol_minor(8);
      hello.mutable_hello_reply()->set_profile(ProfileToWire({}));
      socket.Reply(socket.ReadRequest()->request_id(), std::move(hello));
      for (int i = 0; i < 2; ++i) {
        const auto request = socket.ReadRequest();
        if (!request) return;
        const wire::ChangeSession& change = request->change_session();
        asked.push_back(change.vehicle() + "/" + change.session() + " by " + change.author() +
                        ": " + change.reason());
        wire::Envelope reply;
        reply.mutable_change_session_reply()->set_changed(true);
        socket.Reply(request->request_id(), std::move(reply));
      }
    });
    auto client = AtlasClient::Connect(peer.options());
    ASSERT_TRUE(client);
    EXPECT_TRUE(client->ChangeSession({"bus", "day"}, SessionAction::kRetract, "alice", "rain"));
    EXPECT_TRUE(client->ChangeVehicle("bus", SessionAction::kRestore, "bob", "it was dry"));
  }
  EXPECT_EQ(asked, (std::vector<std::string>{"bus/day by alice: rain", "bus/ by bob: it was dry"}));
}

TEST(AtlasClientTest, ASessionThatIsNoneIsNotAskedFor) {
  TestPeer peer([](PeerSocket& socket) {
    AnswerHello(socket, {});
    socket.Drain();
  });
  auto client = AtlasClient::Connect(peer.options());
  ASSERT_TRUE(client);
  for (const SessionKey& key : {SessionKey{"", "day"}, SessionKey{"bus", "a/b"}}) {
    EXPECT_EQ(client->ChangeSession(key, SessionAction::kRetract, "me").error().code(),
              StatusCode::kInvalidArgument);
  }
}

// A daemon of protocol 1.`minor` that answers with these pages, one a request.
Result<std::vector<KeyframeSummary>> ListedFrom(std::uint32_t minor,
                                                const std::vector<wire::KeyframesReply>& pages) {
  TestPeer peer([&pages, minor](PeerSocket& socket) {
    wire::Envelope hello;
    hello.mutable_hello_reply()->set_protocol_major(kProtocolMajor);
    hello.mutable_hello_reply()->set_protocol_minor(minor);
    hello.mutable_hello_reply()->set_profile(ProfileToWire({}));
    socket.Reply(socket.ReadRequest()->request_id(), std::move(hello));
    for (const wire::KeyframesReply& page : pages) {
      const auto request = socket.ReadRequest();
      if (!request) return;
      wire::Envelope reply;
      *reply.mutable_keyframes_reply() = page;
      socket.Reply(request->request_id(), std::move(reply));
    }
    socket.Drain();
  });
  auto client = AtlasClient::Connect(peer.options());
  return client ? client->ListKeyframes({"bus", "day"}) : Error(client.error());
}

wire::KeyframesReply PageOf(const std::vector<std::uint32_t>& sequences, bool has_more) {
  wire::KeyframesReply page;
  for (const std::uint32_t sequence : sequences) {
    wire::KeyframeInfo& keyframe = *page.add_keyframes();
    keyframe.set_sequence(sequence);
    QuantizedPose pose;
    pose.x_um = 1'000 * std::int64_t{sequence};
    *keyframe.mutable_pose() = PoseToWire(pose);
  }
  page.set_has_more(has_more);
  return page;
}

TEST(AtlasClientTest, KeyframesComePageByPage) {
  const auto listed = ListedFrom(10, {PageOf({0, 3}, true), PageOf({4}, false)});
  ASSERT_TRUE(listed) << listed.error().message();
  ASSERT_EQ(listed->size(), 3U);
  EXPECT_EQ(listed->back().sequence, 4U);
  EXPECT_EQ(listed->back().T_world_sensor.x_um, 4'000);
  EXPECT_TRUE(ListedFrom(10, {PageOf({}, false)})->empty());
}

TEST(AtlasClientTest, PagesOfKeyframesThatLeadNowhereAreRefused) {
  wire::KeyframesReply without_pose = PageOf({1}, false);
  without_pose.mutable_keyframes(0)->clear_pose();
  for (const auto& pages :
       {std::vector{PageOf({}, true)}, std::vector{PageOf({2, 2}, false)},
        std::vector{PageOf({5}, true), PageOf({4}, false)}, std::vector{without_pose}}) {
    const auto listed = ListedFrom(10, pages);
    ASSERT_FALSE(listed);
    EXPECT_EQ(listed.error().code(), StatusCode::kInvalidData) << listed.error().message();
  }
  EXPECT_EQ(ListedFrom(9, {}).error().code(), StatusCode::kUnsupported);
}

}  // namespace
}  // namespace atlas
