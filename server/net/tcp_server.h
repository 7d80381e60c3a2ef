// Accepts connections and runs the network thread.
#pragma once

#include <memory>

#include "server/net/listen_socket.h"
#include "server/net/net_options.h"
#include "server/service/atlas_service.h"

namespace atlas {

class TcpServer {
 public:
  // SIGTERM and SIGINT are its own from here on: whoever learns the address may stop the daemon.
  TcpServer(AtlasService& service, const NetOptions& options, ListenSocket socket);
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;
  ~TcpServer();

  // Serves until SIGTERM, SIGINT or Stop(): then accepts no more, ends the
  // service's waits, lets requests in flight finish for a while, closes everything and returns.
  // Call once.
  void Run();
  // From any thread.
  void Stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace atlas
