// An HTTP client of blocking sockets that can say anything. Every wait ends: a server that stays
// silent fails the test.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace atlas {

struct HttpAnswer {
  int status = 0;
  std::map<std::string, std::string> fields;  // names in lower case
  std::string body;
};

class HttpPeer {
 public:
  explicit HttpPeer(std::uint16_t port);
  HttpPeer(const HttpPeer&) = delete;
  HttpPeer& operator=(const HttpPeer&) = delete;
  ~HttpPeer();

  // False when the server closed.
  bool Send(const std::string& text) const;
  // What came until the server closed.
  std::string ReceiveAll() const;
  // nullopt: it closed without a word.
  std::optional<HttpAnswer> ReceiveAnswer() const;

 private:
  int fd_;
};

// "GET /path HTTP/1.1" and so on.
std::string RequestFor(const std::string& path, const std::string& method = "GET");
// On a connection of its own. A status of 0: no answer.
HttpAnswer Ask(std::uint16_t port, const std::string& path, const std::string& method = "GET");
// Asks again and again, until the answer has this status or half a minute is over: the last one.
HttpAnswer AskUntil(std::uint16_t port, const std::string& path, int status);

}  // namespace atlas
