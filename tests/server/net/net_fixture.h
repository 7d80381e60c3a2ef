// A served atlas on a free port of loopback, and the requests that tests send to it.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <string>
#include <thread>

#include "proto/wire/convert.h"
#include "server/net/tcp_server.h"
#include "tests/server/net/blocking_peer.h"
#include "tests/server/service/service_fixture.h"

namespace atlas {

class NetTest : public ServiceTest {
 protected:
  ~NetTest() override { StopServer(); }

  void Serve(unsigned workers = 1) {
    Listen(workers);
    Run();
  }
  void Listen(unsigned workers) {
    Open(workers);
    Result<ListenSocket> socket = ListenSocket::Open("127.0.0.1", 0);
    ASSERT_TRUE(socket.has_value()) << socket.error().message();
    port_ = socket->port();
    server_ = std::make_unique<TcpServer>(*service_, net_, *std::move(socket), security_);
  }
  void Run() {
    run_ = std::async(std::launch::async, [this] { server_->Run(); });
  }
  // The server, told to stop, has drained in time.
  bool HasDrained() const {
    return run_.wait_for(std::chrono::seconds(30)) == std::future_status::ready;
  }
  void StopServer() {
    if (server_) {
      server_->Stop();
      run_.get();
    }
    server_.reset();
  }

  std::unique_ptr<BlockingPeer> Connect(int buffer_bytes = 0) const {
    auto peer = std::make_unique<BlockingPeer>(port_, buffer_bytes);
    EXPECT_EQ(peer->Greet().body_case(), wire::Envelope::kHelloReply);
    return peer;
  }
  // A good client is served, whatever the others do.
  void ExpectServes() const {
    const auto peer = Connect();
    peer->Send(StatusOf(77));
    const auto reply = peer->Receive();
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->request_id(), 77u);
    EXPECT_EQ(reply->body_case(), wire::Envelope::kStatusReply);
  }
  // Nothing is left of any request, a moment after the reply to the last one.
  void ExpectHoldsNothing() const { ExpectHolds(0); }
  // So much of requests is there, in a moment.
  void ExpectHolds(std::uint64_t bytes) const { ExpectFigure(&NetFigures::held_bytes, bytes); }
  // So much of large requests that are not whole, and their deadlines are known.
  void ExpectParts(std::uint64_t bytes) const { ExpectFigure(&NetFigures::part_bytes, bytes); }
  // `figure`: a member of NetFigures, or what is made of them.
  template <typename Figure>
  void ExpectFigure(Figure figure, std::uint64_t expected) const {
    std::uint64_t read = 0;
    WaitFor([&](const NetFigures& now) {
      read = std::invoke(figure, now);
      return read == expected;
    });
    EXPECT_EQ(read, expected);
  }
  // False if it never becomes true.
  template <typename Predicate>
  bool WaitFor(Predicate is_so) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!is_so(server_->ReadFigures())) {
      if (std::chrono::steady_clock::now() > deadline) {
        return false;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  // A request has come, and is not over.
  static bool HoldsSomething(const NetFigures& now) { return now.held_bytes > 0; }
  // What was queued until nothing changes any more, and is then. Requests that are still on their
  // way and a plan that takes long look as if nothing changed: it is waited for what is expected.
  struct Queued {
    std::uint64_t most = 0;
    std::uint64_t at_rest = 0;
  };
  struct QueuedBounds {
    std::uint64_t more_than = 0;                                        // at some time
    std::uint64_t at_most = std::numeric_limits<std::uint64_t>::max();  // at rest
  };
  Queued WaitUntilAtRest(const QueuedBounds& expected) const {
    constexpr int kAtRest = 50;
    NetFigures last;
    std::uint64_t most = 0;
    int unchanged = 0;
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (std::chrono::steady_clock::now() < deadline &&
           (unchanged < kAtRest || most <= expected.more_than ||
            last.queued_bytes > expected.at_most)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      const NetFigures now = server_->ReadFigures();
      most = std::max(most, now.queued_bytes);
      unchanged =
          now.sent_bytes == last.sent_bytes && now.in_flight == last.in_flight ? unchanged + 1 : 0;
      last = now;
    }
    return {most, last.queued_bytes};
  }
  // `count` queries, padded with a field that the daemon does not know: few of them fill a socket.
  static Bytes PaddedQueries(std::uint64_t count) {
    Bytes bytes;
    for (std::uint64_t id = 1; id <= count; ++id) {
      wire::Envelope query = QueryOf(id);
      auto* const unknown = query.GetReflection()->MutableUnknownFields(&query);
      unknown->AddLengthDelimited(1'000)->assign(2'000, 'x');
      const Bytes frame = EncodeEnvelopeFrame(query).value();
      bytes.insert(bytes.end(), frame.begin(), frame.end());
    }
    return bytes;
  }
  // kOk for a reply that is no error, or none.
  static StatusCode CodeOf(const std::optional<wire::Envelope>& reply) {
    return reply && reply->has_error() ? ErrorFromWire(reply->error()).status.code()
                                       : StatusCode::kOk;
  }

  static wire::Envelope UploadOf(UploadRequest upload, std::uint64_t request_id) {
    wire::Envelope envelope;
    envelope.set_request_id(request_id);
    wire::UploadKeyframe& message = *envelope.mutable_upload_keyframe();
    *message.mutable_key() = KeyToWire(upload.key);
    message.set_time_ms(upload.time_ms);
    *message.mutable_pose() = PoseToWire(upload.pose);
    message.set_blob(BytesToWire(upload.blob));
    return envelope;
  }
  static wire::Envelope UploadOf(std::uint32_t i, std::uint64_t request_id) {
    return UploadOf(DriveUpload(i), request_id);
  }
  static wire::Envelope StatusOf(std::uint64_t request_id) {
    wire::Envelope envelope;
    envelope.set_request_id(request_id);
    envelope.mutable_status_request();
    return envelope;
  }
  static wire::Envelope WaitOf(std::uint64_t request_id, std::uint32_t timeout_ms) {
    wire::Envelope envelope;
    envelope.set_request_id(request_id);
    envelope.mutable_wait_request()->set_timeout_ms(timeout_ms);
    return envelope;
  }
  static wire::Envelope QueryOf(std::uint64_t request_id, std::uint64_t budget_bytes = 0) {
    wire::Envelope envelope;
    envelope.set_request_id(request_id);
    envelope.mutable_query_region()->set_budget_bytes(budget_bytes);
    return envelope;
  }

  NetOptions net_;
  ServerSecurity security_;
  std::unique_ptr<TcpServer> server_;
  std::uint16_t port_ = 0;

 private:
  std::future<void> run_;
};

}  // namespace atlas
