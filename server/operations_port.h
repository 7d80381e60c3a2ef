// What whoever runs the daemon asks it over HTTP: does it live (/healthz), may it be sent work
// (/readyz), what does it do (/metrics).
#pragma once

#include "server/http/http_server.h"
#include "server/net/tcp_server.h"
#include "server/service/atlas_service.h"
#include "server/store/atlas_store.h"

namespace atlas {

class OperationsPort {
 public:
  // Serves from now on; all outlive this, and `server` drains before it goes.
  OperationsPort(AtlasService& service,
                 AtlasStore& store,
                 TcpServer& server,
                 ListenSocket socket,
                 const HttpOptions& options = {});

 private:
  HttpServer http_;
};

}  // namespace atlas
