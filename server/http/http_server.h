// A small HTTP/1.1 server (RFC 9112) for whoever runs the daemon: GET and HEAD of a few pages, one
// request a connection, every size, count and wait limited. On threads of its own.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/http/http_page.h"
#include "server/net/listen_socket.h"

namespace atlas {

struct HttpOptions {
  std::size_t max_requests = 32;  // as many more are told 503, others are closed
  // Connections whose request is not whole yet: for one more the oldest of them is closed.
  std::size_t max_silent = 64;
  std::uint32_t max_header_bytes = 8u << 10;
  std::chrono::milliseconds deadline{5'000};  // for each of the request, the page and the reply
  std::chrono::milliseconds linger{1'000};    // for a peer that still sends to read its reply
};

class HttpServer {
 public:
  // Serves from now on.
  HttpServer(ListenSocket socket, std::vector<HttpPage> pages, const HttpOptions& options = {});
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  // Closes what is open; waits for pages that are being made.
  ~HttpServer();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace atlas
