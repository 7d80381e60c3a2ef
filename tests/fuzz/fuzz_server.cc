// A daemon and what a client sends it after its Hello, over loopback: every request gets its
// answer, or the connection its end.
#include <future>
#include <memory>
#include <optional>

#include <openssl/crypto.h>

#include "proto/wire/convert.h"
#include "server/net/tcp_server.h"
#include "tests/fuzz/support/frame_packing.h"
#include "tests/fuzz/support/loopback.h"
#include "tests/fuzz/support/request_seeds.h"
#include "tests/fuzz/support/strict_log.h"
#include "tests/fuzz/support/tiny_atlas.h"

namespace atlas::fuzz {
namespace {

constexpr std::uint64_t kLastId = 0xFFFF'FFFF'FFFF;
constexpr std::size_t kMaxRequests = 48;  // some may wait for a day, and no more than 64 are read
constexpr int kInputsADaemon = 200;       // what they stored is forgotten then

class Daemon {
 public:
  Daemon() {
    NetOptions options;
    options.clear_visits_per_s = 0;  // no limit
    ListenSocket socket = ListenSocket::Open("127.0.0.1", 0).value();
    port_ = socket.port();
    server_ = std::make_unique<TcpServer>(atlas_.service(), options, std::move(socket));
    run_ = std::async(std::launch::async, [this] { server_->Run(); });
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  Daemon(Daemon&&) = delete;
  Daemon& operator=(Daemon&&) = delete;
  ~Daemon() {
    server_->Stop();
    run_.get();
  }

  std::uint16_t port() const { return port_; }

 private:
  TinyAtlas atlas_;
  std::unique_ptr<TcpServer> server_;
  std::uint16_t port_ = 0;
  std::future<void> run_;
};

// What its threads use to their end is there before the first daemon, and goes after the last.
// OpenSSL registers what takes it apart when it is asked for something that it has not done yet.
bool PrepareLibraries() {
  UseStrictLog();
  return OPENSSL_init_crypto(OPENSSL_INIT_ADD_ALL_DIGESTS, nullptr) == 1;
}

std::uint16_t PortOfDaemon() {
  [[maybe_unused]] static const bool kIsPrepared = PrepareLibraries();
  static std::unique_ptr<Daemon> daemon;
  static int inputs = 0;
  if (inputs++ % kInputsADaemon == 0) {
    daemon.reset();
    daemon = std::make_unique<Daemon>();
  }
  return daemon->port();
}

std::vector<Bytes> Seeds() {
  const std::vector<wire::Envelope> requests = RequestSeeds(TinyAtlas::Profile());
  std::vector<Bytes> seeds;
  for (const wire::Envelope& request : requests) {
    seeds.push_back(FramesOf({request}));
  }
  seeds.push_back(FramesOf(requests));
  return seeds;
}

// How a stream ends, as docs/protocol.md has it.
enum class End { kAfterFrame, kWithinFrame, kBroken };

struct Shape {
  std::size_t frames = 0;
  End end = End::kAfterFrame;
};

Shape ShapeOf(ByteSpan stream) {
  FrameDecoder decoder;
  decoder.Push(stream);
  Shape shape;
  auto payload = decoder.Next();
  for (; payload && *payload; payload = decoder.Next()) {
    ++shape.frames;
    if (!ParseEnvelope(**payload)) {
      shape.end = End::kBroken;
      return shape;
    }
  }
  shape.end = !payload                      ? End::kBroken
              : decoder.pending_bytes() > 0 ? End::kWithinFrame
                                            : End::kAfterFrame;
  return shape;
}

// What the daemon says until it closes, or until the reply to the last request.
class Replies {
 public:
  explicit Replies(const LoopbackSocket& socket) : socket_(socket) {}

  // nullopt: the daemon has closed.
  std::optional<wire::Envelope> Next() {
    while (true) {
      const auto payload = decoder_.Next();
      Require(payload.has_value(), "the daemon sends frames");
      if (*payload) {
        auto envelope = ParseEnvelope(**payload);
        Require(envelope.has_value(), "the daemon sends envelopes");
        return *std::move(envelope);
      }
      const Bytes more = socket_.Receive();
      if (more.empty()) {
        return std::nullopt;
      }
      decoder_.Push(more);
    }
  }

 private:
  const LoopbackSocket& socket_;
  FrameDecoder decoder_;
};

wire::Envelope LastRequest() {
  wire::Envelope envelope;
  envelope.set_request_id(kLastId);
  envelope.mutable_status_request();
  return envelope;
}

bool Run(ByteSpan stream) {
  const Shape shape = ShapeOf(stream);
  if (shape.frames > kMaxRequests) {
    return false;
  }
  const LoopbackSocket socket = LoopbackSocket::Connect(PortOfDaemon());
  Replies replies(socket);
  socket.Send(FramesOf({HelloSeed(TinyAtlas::Profile())}));
  const auto hello = replies.Next();
  Require(hello && hello->has_hello_reply(), "the daemon greets");
  socket.Send(stream);
  if (shape.end == End::kAfterFrame) {
    socket.Send(FramesOf({LastRequest()}));
  } else {
    socket.CloseSending();
  }
  for (auto reply = replies.Next(); reply; reply = replies.Next()) {
    Require(!reply->has_error() || reply->error().code() != static_cast<int>(StatusCode::kInternal),
            "no mistake of the daemon");
    if (reply->request_id() == kLastId && reply->has_status_reply()) {
      return shape.frames > 0;
    }
  }
  Require(shape.end != End::kAfterFrame, "the last request is answered");
  return false;
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  return MutateFrames(input, max_size, random, &MutateWireBlob);
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
