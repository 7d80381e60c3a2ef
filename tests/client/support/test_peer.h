// The other end of a client's connection, in the test's hand: one connection on a loopback port,
// served by a function on its own thread.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "client/connection/atlas_client.h"
#include "client/connection/endpoint.h"
#include "proto/wire/envelope.h"

namespace atlas {

// The accepted socket; blocking.
class PeerSocket {
 public:
  explicit PeerSocket(int fd) : fd_(fd) {}

  // False when the client is gone.
  bool Write(ByteSpan bytes);
  bool Reply(std::uint64_t request_id, wire::Envelope reply);
  // nullopt when the client closed.
  std::optional<wire::Envelope> ReadRequest();
  // Reads and drops until the client closes.
  void Drain();
  // Nothing more is written: the client hears all that was, and then the end.
  void EndWriting();

 private:
  int fd_;
  FrameDecoder decoder_;
};

class TestPeer {
 public:
  explicit TestPeer(std::function<void(PeerSocket&)> serve);
  ~TestPeer();
  TestPeer(const TestPeer&) = delete;
  TestPeer& operator=(const TestPeer&) = delete;
  TestPeer(TestPeer&&) = delete;
  TestPeer& operator=(TestPeer&&) = delete;

  Endpoint endpoint() const { return {"127.0.0.1", port_}; }
  // Short deadlines, for peers that never answer.
  ConnectionOptions options() const;

 private:
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::thread thread_;
};

// Whom the daemon takes a client for.
struct PeerIdentity {
  std::string name;
  std::string role;
};

// Which atlas it has.
struct PeerAtlas {
  std::string id = std::string(16, 'a');
  std::uint64_t epoch = 1;
};

// Reads the Hello and answers as a daemon with this profile.
void AnswerHello(PeerSocket& socket,
                 const MapProfile& profile,
                 const PeerIdentity& client = {},
                 const PeerAtlas& atlas = {});

}  // namespace atlas
