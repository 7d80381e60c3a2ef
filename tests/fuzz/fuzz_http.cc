// What comes to the operations port over loopback: always one answer, or a closed connection.
#include <chrono>
#include <optional>
#include <string>

#include "server/http/http_server.h"
#include "tests/fuzz/support/fuzz_target.h"
#include "tests/fuzz/support/loopback.h"

namespace atlas::fuzz {
namespace {

struct Server {
  Server() {
    ListenSocket socket = ListenSocket::Open("127.0.0.1", 0).value();
    port = socket.port();
    HttpOptions options;
    options.linger = std::chrono::milliseconds(0);
    http.emplace(std::move(socket),
                 std::vector<HttpPage>{{"/metrics",
                                        [] {
                                          return HttpReply{200, "text/plain", "a 1\n"};
                                        }}},
                 options);
  }

  std::uint16_t port = 0;
  std::optional<HttpServer> http;
};

std::vector<Bytes> Seeds() {
  return {BytesOf("GET /metrics HTTP/1.1\r\nHost: localhost\r\nAccept: text/plain;q=0.5\r\n\r\n"),
          BytesOf("HEAD /metrics?a=b HTTP/1.0\r\n\r\n"),
          BytesOf("GET /metrics HTTP/1.1\r\nhost: x\r\nConnection: keep-alive, "
                  "Upgrade\r\nContent-Length: 0\r\n"
                  "X-Folded: a\r\n b\r\n\r\n")};
}

bool Run(ByteSpan request) {
  static const Server kServer;
  const LoopbackSocket socket = LoopbackSocket::Connect(kServer.port);
  socket.Send(request);
  socket.CloseSending();
  std::string answer;
  for (Bytes more = socket.Receive(); !more.empty(); more = socket.Receive()) {
    answer.append(TextOf(more));
  }
  Require(answer.empty() || answer.starts_with("HTTP/1.1 "), "an answer is HTTP");
  return answer.starts_with("HTTP/1.1 200 ");
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz
