// Accepts connections and spreads them over the network threads.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "server/net/listen_socket.h"
#include "server/net/net_counters.h"
#include "server/net/net_options.h"
#include "server/net/server_security.h"
#include "server/service/atlas_service.h"

namespace atlas {

class TcpServer {
 public:
  // SIGTERM and SIGINT are its own from here on: whoever learns the address may stop the daemon.
  // SIGPIPE is ignored from here on.
  TcpServer(AtlasService& service,
            const NetOptions& options,
            ListenSocket socket,
            ServerSecurity security = {});
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;
  ~TcpServer();

  // Serves until SIGTERM, SIGINT or Stop(): then accepts no more, ends the
  // service's waits, lets requests in flight finish for a while, closes everything and returns.
  // Call once.
  void Run();
  // From any thread.
  void Stop();
  // From any thread: what new connections find from now on, and whom of those that are there it
  // closes. TLS stays with or without, as it was at the start.
  void ChangeSecurity(ServerSecurity security);
  // From any thread: what each name may have from now on.
  void ChangeNameLimits(const NameLimits& limits);

  // From any thread, as are the next two.
  NetFigures ReadFigures() const;
  std::size_t threads() const;
  // Calls `answer` on the network thread with this number, as soon as it gets to it.
  void Probe(std::size_t thread, std::function<void()> answer);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace atlas
