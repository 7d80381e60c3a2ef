// Accepts connections and runs the network thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/base/status.h"
#include "server/net/net_options.h"
#include "server/service/atlas_service.h"

namespace atlas {

class TcpServer {
 public:
  TcpServer(AtlasService& service, const NetOptions& options);
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;
  ~TcpServer();

  // Port 0 takes a free one. The bound "HOST:PORT"; kInvalidArgument for what is no address,
  // kUnavailable when the port is taken.
  Result<std::string> Listen(const std::string& host, std::uint16_t port);

  // Serves until SIGTERM or SIGINT (those since Listen()) or Stop(): then accepts no more, ends the
  // service's waits, lets requests in flight finish for a while, closes everything and returns.
  // Call once, after Listen().
  void Run();
  // From any thread.
  void Stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace atlas
