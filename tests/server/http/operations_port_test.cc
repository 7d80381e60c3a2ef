// What the operations port tells of a daemon at work, one that hangs and one that stops.
#include "server/operations_port.h"

#include <chrono>
#include <future>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/server/http/http_peer.h"
#include "tests/server/http/metrics_lines.h"
#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

using ::testing::HasSubstr;

// Nobody else can write the atlas while it is there.
class HeldStore {
 public:
  explicit HeldStore(const std::filesystem::path& file) {
    EXPECT_EQ(sqlite3_open(file.c_str(), &db_), SQLITE_OK);
    sqlite3_busy_timeout(db_, 10'000);
    EXPECT_EQ(sqlite3_exec(db_, "BEGIN IMMEDIATE", nullptr, nullptr, nullptr), SQLITE_OK);
  }
  HeldStore(const HeldStore&) = delete;
  HeldStore& operator=(const HeldStore&) = delete;
  ~HeldStore() { sqlite3_close(db_); }

 private:
  sqlite3* db_ = nullptr;
};

class OperationsPortTest : public NetTest {
 protected:
  ~OperationsPortTest() override { port_for_operations_.reset(); }

  void ServeWithOperations(unsigned workers = 0) {
    Serve(workers);
    Result<ListenSocket> socket = ListenSocket::Open("127.0.0.1", 0);
    ASSERT_TRUE(socket.has_value()) << socket.error().message();
    http_ = socket->port();
    port_for_operations_ =
        std::make_unique<OperationsPort>(*service_, *store_, *server_, *std::move(socket));
  }
  // What a network thread does after a reply has left is done.
  void Settle() const {
    for (std::size_t i = 0; i < server_->threads(); ++i) {
      std::promise<void> done;
      server_->Probe(i, [&done] { done.set_value(); });
      done.get_future().wait();
    }
  }
  std::map<std::string, double> Metrics() const {
    Settle();
    const HttpAnswer answer = Ask(http_, "/metrics");
    EXPECT_EQ(answer.status, 200);
    EXPECT_EQ(answer.fields.at("content-type"), "text/plain; version=0.0.4; charset=utf-8");
    return ParseMetrics(answer.body);
  }
  static std::string Requests(const std::string& kind, const std::string& code) {
    return "roadatlas_requests_total{kind=\"" + kind + "\",code=\"" + code + "\"}";
  }
  static std::string Late(const std::string& kind) {
    return "roadatlas_requests_deadline_exceeded_total{kind=\"" + kind + "\"}";
  }
  static std::string Count(const std::string& kind) {
    return "roadatlas_request_seconds_count{kind=\"" + kind + "\"}";
  }

  std::uint16_t http_ = 0;
  std::unique_ptr<OperationsPort> port_for_operations_;
};

// Sends requests one by one, and knows how many bytes went which way.
class CountingPeer {
 public:
  explicit CountingPeer(std::uint16_t port) : peer_(port) {}

  wire::Envelope Call(const wire::Envelope& request) {
    const Bytes frame = EncodeEnvelopeFrame(request).value();
    sent_bytes_ += frame.size();
    EXPECT_TRUE(peer_.SendBytes(frame));
    std::size_t size_bytes = 0;
    const auto reply = peer_.Receive(&size_bytes);
    received_bytes_ += size_bytes;
    return reply.value_or(wire::Envelope());
  }
  std::size_t sent_bytes() const { return sent_bytes_; }
  std::size_t received_bytes() const { return received_bytes_; }

 private:
  BlockingPeer peer_;
  std::size_t sent_bytes_ = 0;
  std::size_t received_bytes_ = 0;
};

wire::Envelope HelloOf(std::uint64_t request_id, std::uint32_t major = kProtocolMajor) {
  wire::Envelope hello;
  hello.set_request_id(request_id);
  hello.mutable_hello()->set_protocol_major(major);
  return hello;
}

wire::Envelope SyncOf(std::uint64_t request_id, std::uint64_t radius_um) {
  wire::Envelope sync;
  sync.set_request_id(request_id);
  sync.mutable_sync_request()->mutable_area()->mutable_disc()->set_radius_um(radius_um);
  return sync;
}

TEST_F(OperationsPortTest, ADaemonAtWorkIsWellAndReady) {
  ServeWithOperations();
  EXPECT_EQ(AskUntil(http_, "/healthz", 200).body, "ok\n");
  EXPECT_EQ(AskUntil(http_, "/readyz", 200).body, "ok\n");
  EXPECT_EQ(Ask(http_, "/").status, 404);
}

TEST_F(OperationsPortTest, ManyWhoSayNothingKeepNobodyOut) {
  ServeWithOperations();
  std::vector<std::unique_ptr<HttpPeer>> silent;
  for (int i = 0; i < 200; ++i) {
    silent.push_back(std::make_unique<HttpPeer>(http_));
  }
  const auto began = std::chrono::steady_clock::now();
  EXPECT_EQ(Ask(http_, "/healthz").status, 200);
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(1));
}

TEST_F(OperationsPortTest, CountersMoveByWhatWasDone) {
  ServeWithOperations();
  EXPECT_EQ(Metrics().at(Requests("hello", "ok")), 0);
  CountingPeer peer(port_);
  EXPECT_TRUE(peer.Call(HelloOf(1)).has_hello_reply());
  EXPECT_TRUE(peer.Call(UploadOf(0, 2)).has_upload_reply());
  EXPECT_TRUE(peer.Call(UploadOf(0, 3)).upload_reply().duplicate());
  wire::Envelope damaged = UploadOf(1, 4);
  damaged.mutable_upload_keyframe()->set_blob("no keyframe");
  EXPECT_TRUE(peer.Call(damaged).has_error());
  EXPECT_TRUE(peer.Call(StatusOf(5)).has_status_reply());
  EXPECT_TRUE(peer.Call(WaitOf(6, 0)).wait_reply().timed_out());
  wire::Envelope nowhere;
  nowhere.set_request_id(7);
  nowhere.mutable_sync_request();
  EXPECT_TRUE(peer.Call(nowhere).has_error());
  EXPECT_TRUE(peer.Call(HelloOf(8)).has_error());
  wire::Envelope unknown;
  unknown.set_request_id(9);
  EXPECT_TRUE(peer.Call(unknown).has_error());

  const auto metrics = Metrics();
  EXPECT_EQ(metrics.at(Requests("hello", "ok")), 1);
  EXPECT_EQ(metrics.at(Requests("hello", "invalid_argument")), 1);
  EXPECT_EQ(metrics.at(Requests("upload_keyframe", "ok")), 2);
  EXPECT_EQ(metrics.at(Requests("upload_keyframe", "invalid_data")), 1);
  EXPECT_EQ(metrics.at(Requests("status", "ok")), 1);
  EXPECT_EQ(metrics.at(Requests("wait", "ok")), 1);
  EXPECT_EQ(metrics.at(Requests("sync", "invalid_argument")), 1);
  EXPECT_EQ(metrics.at(Requests("unknown", "unsupported")), 1);
  EXPECT_EQ(metrics.at(Count("upload_keyframe")), 3);
  EXPECT_EQ(metrics.at(Count("status")), 1);
  EXPECT_EQ(metrics.at("roadatlas_received_bytes_total"), peer.sent_bytes());
  EXPECT_EQ(metrics.at("roadatlas_sent_bytes_total"), peer.received_bytes());
  EXPECT_EQ(metrics.at("roadatlas_connections"), 1);
  EXPECT_EQ(metrics.at("roadatlas_requests_in_flight"), 0);
  EXPECT_EQ(metrics.at("roadatlas_held_bytes"), 0);
  EXPECT_EQ(metrics.at("roadatlas_queued_reply_bytes"), 0);
  EXPECT_EQ(metrics.at("roadatlas_large_request_bytes"), 0);
  EXPECT_EQ(metrics.at("roadatlas_large_requests_closed_total"), 0);
  EXPECT_EQ(metrics.at("roadatlas_broken_frames_total"), 0);
  EXPECT_EQ(metrics.at("roadatlas_tls_handshakes_failed_total"), 0);
  EXPECT_EQ(metrics.at(Late("wait")), 1);
  EXPECT_EQ(metrics.at(Late("status")), 0);
  EXPECT_EQ(metrics.at("roadatlas_keyframes"), 1);
  EXPECT_EQ(metrics.at("roadatlas_revision"), 1);
  EXPECT_GT(metrics.at("roadatlas_dirty_tiles"), 0);
  EXPECT_EQ(metrics.at("roadatlas_fusion_tiles_total"), 0);
  EXPECT_EQ(metrics.at("roadatlas_store_commits_total"), 1);  // a duplicate writes nothing
  EXPECT_EQ(metrics.at("roadatlas_store_commit_seconds_count"), 1);
  EXPECT_GT(metrics.at("roadatlas_resident_bytes"), 1e6);
}

TEST_F(OperationsPortTest, WhatIsFusedIsCounted) {
  ServeWithOperations(1);
  UploadDrive(2);
  Digest();
  const auto metrics = Metrics();
  EXPECT_EQ(metrics.at("roadatlas_dirty_tiles"), 0);
  EXPECT_GE(metrics.at("roadatlas_fusion_tiles_total"), metrics.at("roadatlas_tiles"));
  EXPECT_GT(metrics.at("roadatlas_fusion_seconds_total"), 0);
  EXPECT_GT(metrics.at("roadatlas_tiles"), 0);
  EXPECT_GT(metrics.at("roadatlas_tile_bytes"), 0);
  EXPECT_GT(metrics.at("roadatlas_store_bytes"), 0);
}

TEST_F(OperationsPortTest, ASyncOutOfMemoryIsARequest) {
  ServeWithOperations(1);
  UploadDrive(2);
  Digest();
  const auto peer = Connect();
  for (std::uint64_t id = 1; id <= 3; ++id) {
    peer->Send(SyncOf(id, 10'000'000));
    while (!peer->Receive()->has_sync_end()) {
    }
  }
  const auto metrics = Metrics();
  EXPECT_EQ(metrics.at(Requests("sync", "ok")), 3);
  EXPECT_EQ(metrics.at("roadatlas_requests_in_flight"), 0);
}

TEST_F(OperationsPortTest, WhatIsUnderWayIsInFlight) {
  ServeWithOperations();
  UploadDrive(1);
  const auto peer = Connect();
  peer->Send(WaitOf(1, 3'600'000));
  peer->Send(StatusOf(2));
  EXPECT_TRUE(peer->Receive()->has_status_reply());
  const auto metrics = Metrics();
  EXPECT_EQ(metrics.at("roadatlas_requests_in_flight"), 1);
  EXPECT_EQ(metrics.at("roadatlas_held_bytes"), EncodeEnvelopeFrame(WaitOf(1, 3'600'000))->size());
  EXPECT_EQ(metrics.at(Requests("wait", "ok")), 0);
}

TEST_F(OperationsPortTest, RefusedConnectionsAreCounted) {
  net_.max_connections = 1;
  ServeWithOperations();
  const auto peer = Connect();
  BlockingPeer refused(port_);
  EXPECT_EQ(CodeOf(refused.Receive()), StatusCode::kUnavailable);
  const auto metrics = Metrics();
  EXPECT_EQ(metrics.at("roadatlas_connections"), 1);
  EXPECT_EQ(metrics.at("roadatlas_connections_refused_total"), 1);
}

TEST_F(OperationsPortTest, AWriterThatHangsIsNamed) {
  ServeWithOperations();
  {
    const HeldStore held(directory_ / "data" / "atlas.db");
    const HttpAnswer health = Ask(http_, "/healthz");
    EXPECT_EQ(health.status, 503);
    EXPECT_THAT(health.body, HasSubstr("no answer within 1000 ms: the store's writer\n"));
    const HttpAnswer ready = Ask(http_, "/readyz");
    EXPECT_EQ(ready.status, 503);
    EXPECT_THAT(ready.body, HasSubstr("the store's writer"));
    EXPECT_EQ(Ask(http_, "/metrics").status, 200);
  }
  EXPECT_EQ(AskUntil(http_, "/healthz", 200).status, 200);
  EXPECT_EQ(AskUntil(http_, "/readyz", 200).status, 200);
}

// A quota is one vehicle's: others may be sent.
TEST_F(OperationsPortTest, AFullStoreAndADiskBelowItsFloorAreNotReady) {
  ServeWithOperations();
  UploadDrive(1);
  service_->SetRetention({{.vehicle_bytes = 1}, false});
  EXPECT_EQ(Upload(DriveUpload(1)).error().reason(), StatusReason::kQuota);
  EXPECT_EQ(AskUntil(http_, "/readyz", 200).body, "ok\n");
  service_->SetRetention({{.store_bytes = 1}, false});
  EXPECT_THAT(Ask(http_, "/readyz").body, HasSubstr("retention.store_mib"));
  service_->SetRetention({{.disk_floor_bytes = std::uint64_t{1} << 62U}, false});
  const HttpAnswer below = Ask(http_, "/readyz");
  EXPECT_EQ(below.status, 503);
  EXPECT_THAT(below.body, HasSubstr("retention.disk_floor_mib"));
  EXPECT_EQ(AskUntil(http_, "/healthz", 200).status, 200);
  service_->SetRetention({});
  EXPECT_EQ(Ask(http_, "/readyz").body, "ok\n");
  EXPECT_EQ(Metrics().at(R"(roadatlas_uploads_refused_total{reason="quota"})"), 1);
  EXPECT_GT(Metrics().at("roadatlas_store_used_bytes"), 1e4);
}

// It takes no more keyframes of that size, though it has a little room.
TEST_F(OperationsPortTest, AnUploadThatAStoreRefusedCountsForAWhile) {
  ServeWithOperations();
  UploadDrive(1);
  service_->SetRetention({{.store_bytes = store_->ReadRoom().used_bytes + 1}, false});
  EXPECT_EQ(AskUntil(http_, "/readyz", 200).body, "ok\n");
  EXPECT_EQ(Upload(DriveUpload(1)).error().reason(), StatusReason::kStoreLimit);
  EXPECT_EQ(Ask(http_, "/readyz").status, 503);
}

TEST_F(OperationsPortTest, ANetworkThreadThatHangsIsNamed) {
  net_.threads = 2;
  ServeWithOperations();
  std::promise<void> release;
  server_->Probe(1, [held = release.get_future().share()] { held.wait(); });
  const HttpAnswer health = Ask(http_, "/healthz");
  EXPECT_EQ(health.status, 503);
  EXPECT_THAT(health.body, HasSubstr(": network thread 1\n"));
  release.set_value();
  EXPECT_EQ(AskUntil(http_, "/healthz", 200).status, 200);
}

TEST_F(OperationsPortTest, ADaemonThatDrainsIsWellAndNotReady) {
  net_.drain = std::chrono::minutes(2);  // longer than the test waits
  net_.max_queued_bytes = 1'024;
  ServeWithOperations(1);
  UploadDrive(12);
  Digest();
  auto peer = Connect(4'096);
  peer->SendUntilStuck(PaddedQueries(3'000), std::chrono::milliseconds(500));
  server_->Stop();
  EXPECT_EQ(AskUntil(http_, "/readyz", 503).body, "draining\n");
  EXPECT_EQ(AskUntil(http_, "/healthz", 200).status, 200);
  EXPECT_EQ(Metrics().at("roadatlas_connections"), 1);
  peer.reset();
  EXPECT_TRUE(HasDrained());
  EXPECT_EQ(Ask(http_, "/readyz").body, "draining\n");
}

}  // namespace
}  // namespace atlas
