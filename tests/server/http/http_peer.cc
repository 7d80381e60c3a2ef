#include "tests/server/http/http_peer.h"

#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <sstream>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

namespace atlas {
namespace {

constexpr timeval kPatience{30, 0};

HttpAnswer Parse(const std::string& text) {
  HttpAnswer answer;
  const std::size_t end = text.find("\r\n\r\n");
  std::istringstream header(text.substr(0, end));
  std::string line;
  std::getline(header, line);
  std::istringstream(line.substr(line.find(' '))) >> answer.status;
  while (std::getline(header, line)) {
    const std::size_t colon = line.find(':');
    std::string name = line.substr(0, colon);
    for (char& c : name) {
      c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    const std::string value = line.substr(colon + 2);
    answer.fields[name] = value.substr(0, value.find('\r'));
  }
  answer.body = end == std::string::npos ? "" : text.substr(end + 4);
  return answer;
}

}  // namespace

HttpPeer::HttpPeer(std::uint16_t port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  ::setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
}

HttpPeer::~HttpPeer() {
  ::close(fd_);
}

bool HttpPeer::Send(const std::string& text) const {
  std::size_t total = 0;
  while (total < text.size()) {
    const ssize_t sent = ::send(fd_, text.data() + total, text.size() - total, MSG_NOSIGNAL);
    if (sent <= 0) {
      return false;
    }
    total += static_cast<std::size_t>(sent);
  }
  return true;
}

std::string HttpPeer::ReceiveAll() const {
  std::string text;
  std::array<char, 16'384> chunk{};
  ssize_t size = 0;
  while ((size = ::recv(fd_, chunk.data(), chunk.size(), 0)) > 0) {
    text.append(chunk.data(), static_cast<std::size_t>(size));
  }
  EXPECT_TRUE(size == 0 || errno != EAGAIN) << "the server neither answered nor closed";
  return text;
}

std::optional<HttpAnswer> HttpPeer::ReceiveAnswer() const {
  const std::string text = ReceiveAll();
  if (text.empty()) {
    return std::nullopt;
  }
  EXPECT_EQ(text.substr(0, 9), "HTTP/1.1 ") << text;
  return Parse(text);
}

std::string RequestFor(const std::string& path, const std::string& method) {
  return method + " " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n";
}

HttpAnswer Ask(std::uint16_t port, const std::string& path, const std::string& method) {
  const HttpPeer peer(port);
  peer.Send(RequestFor(path, method));
  return peer.ReceiveAnswer().value_or(HttpAnswer());
}

HttpAnswer AskUntil(std::uint16_t port, const std::string& path, int status) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  HttpAnswer answer = Ask(port, path);
  while (answer.status != status && std::chrono::steady_clock::now() < deadline) {
    answer = Ask(port, path);
  }
  return answer;
}

}  // namespace atlas
