// The operations port as HTTP: what it answers, and what it does not put up with.
#include "server/http/http_server.h"

#include <future>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/http/http_peer.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class HttpServerTest : public testing::Test {
 protected:
  ~HttpServerTest() override {
    Release();  // or the page that hangs would hold up the end
    server_.reset();
  }

  void Serve() {
    Result<ListenSocket> socket = ListenSocket::Open("127.0.0.1", 0);
    ASSERT_TRUE(socket.has_value()) << socket.error().message();
    port_ = socket->port();
    server_ = std::make_unique<HttpServer>(*std::move(socket), Pages(), options_);
  }
  HttpAnswer AnswerTo(const std::string& request) const {
    const HttpPeer peer(port_);
    peer.Send(request);
    return peer.ReceiveAnswer().value_or(HttpAnswer());
  }
  // From now on no page hangs.
  void Release() {
    if (!std::exchange(is_released_, true)) {
      release_.set_value();
    }
  }
  std::vector<std::unique_ptr<HttpPeer>> AskForWhatHangs(int count) const {
    std::vector<std::unique_ptr<HttpPeer>> peers;
    for (int i = 0; i < count; ++i) {
      peers.push_back(std::make_unique<HttpPeer>(port_));
      peers.back()->Send(RequestFor("/hangs"));
    }
    return peers;
  }
  std::vector<HttpPage> Pages() const {
    return {{"/here",
             [] {
               return HttpReply{200, "text/x-test", "hello\n"};
             }},
            {"/ill",
             [] {
               return HttpReply{503, "text/plain", "ill\n"};
             }},
            {"/throws",
             []() -> HttpReply {
               throw std::runtime_error("a test throws");
             }},
            {"/hangs", [held = released_] {
               held.wait();
               return HttpReply();
             }}};
  }

  HttpOptions options_;
  std::uint16_t port_ = 0;

 private:
  bool is_released_ = false;
  std::promise<void> release_;
  std::shared_future<void> released_ = release_.get_future().share();
  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpServerTest, APageIsShown) {
  Serve();
  const HttpAnswer answer = Ask(port_, "/here");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body, "hello\n");
  EXPECT_EQ(answer.fields.at("content-type"), "text/x-test");
  EXPECT_EQ(answer.fields.at("content-length"), "6");
  EXPECT_EQ(answer.fields.at("connection"), "close");
  EXPECT_THAT(answer.fields.at("date"), HasSubstr(" GMT"));
  EXPECT_EQ(Ask(port_, "/here?verbose=1").status, 200);
  EXPECT_EQ(Ask(port_, "/ill").status, 503);
}

TEST_F(HttpServerTest, HeadIsTheHeaderOfGet) {
  Serve();
  const HttpAnswer answer = Ask(port_, "/here", "HEAD");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body, "");
  EXPECT_EQ(answer.fields.at("content-length"), "6");
  EXPECT_EQ(answer.fields.at("content-type"), "text/x-test");
  EXPECT_EQ(Ask(port_, "/nowhere", "HEAD").body, "");
}

TEST_F(HttpServerTest, WhatIsNotThereIs404) {
  Serve();
  for (const char* path : {"/", "/her", "/here/", "/here/../here", "*", "/%68ere"}) {
    EXPECT_EQ(Ask(port_, path).status, 404) << path;
  }
}

TEST_F(HttpServerTest, OtherMethodsAre405) {
  Serve();
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH", "BREW"}) {
    const HttpAnswer answer = Ask(port_, "/here", method);
    EXPECT_EQ(answer.status, 405) << method;
    EXPECT_EQ(answer.fields.at("allow"), "GET, HEAD") << method;
  }
}

TEST_F(HttpServerTest, ARequestHasNoBody) {
  Serve();
  const std::string get = "GET /here HTTP/1.1\r\nHost: x\r\n";
  EXPECT_EQ(AnswerTo(get + "Content-Length: 4\r\n\r\nbody").status, 413);
  EXPECT_EQ(AnswerTo(get + "Content-Length: 99999999999\r\n\r\n").status, 413);
  EXPECT_EQ(AnswerTo(get + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n").status, 413);
  EXPECT_EQ(AnswerTo(get + "Content-Length: 0\r\n\r\n").status, 200);
}

TEST_F(HttpServerTest, WhatIsNoHttpIs400) {
  Serve();
  EXPECT_EQ(AnswerTo("hello there\r\n\r\n").status, 400);
  EXPECT_EQ(AnswerTo("GET /here HTTP/1.1\r\nno colon\r\n\r\n").status, 400);
  EXPECT_EQ(AnswerTo(std::string("RAF1\0\0\0\0\0\0\0\0\r\n\r\n", 16)).status, 400);
}

TEST_F(HttpServerTest, AnOversizeHeaderIs431) {
  Serve();
  const std::string fits(7 << 10, 'x');
  const std::string begin = "GET /here HTTP/1.1\r\nHost: x\r\nX-Long: ";
  EXPECT_EQ(AnswerTo(begin + fits + "\r\n\r\n").status, 200);
  EXPECT_EQ(AnswerTo(begin + fits + fits + "\r\n\r\n").status, 431);
  EXPECT_EQ(AnswerTo("GET /" + fits + fits + " HTTP/1.1\r\n\r\n").status, 431);
}

TEST_F(HttpServerTest, ASlowClientIsCutOff) {
  options_.deadline = milliseconds(200);
  Serve();
  const HttpPeer silent(port_);
  const HttpPeer slow(port_);
  slow.Send("GET /here HT");
  EXPECT_EQ(silent.ReceiveAll(), "");
  EXPECT_EQ(slow.ReceiveAll(), "");
  EXPECT_EQ(AskUntil(port_, "/here", 200).status, 200);
}

TEST_F(HttpServerTest, APeerThatDoesNotCloseIsClosed) {
  options_.linger = milliseconds(200);
  Serve();
  const HttpPeer peer(port_);
  peer.Send(RequestFor("/here"));
  EXPECT_EQ(peer.ReceiveAnswer()->status, 200);
  while (peer.Send("more")) {  // until the server closes
  }
}

TEST_F(HttpServerTest, OneTooManyIsTold) {
  options_.max_requests = 3;
  options_.deadline = std::chrono::minutes(1);  // longer than the requests stay
  Serve();
  const auto requests = AskForWhatHangs(3);
  EXPECT_EQ(Ask(port_, "/here").status, 503);
  EXPECT_THAT(Ask(port_, "/nowhere").body, HasSubstr("too many requests"));
  EXPECT_THAT(AnswerTo("hello there\r\n\r\n").body, HasSubstr("too many requests"));
  Release();
  EXPECT_EQ(AskUntil(port_, "/here", 200).status, 200);
}

TEST_F(HttpServerTest, BeyondTwiceTheLimitAConnectionIsClosed) {
  options_.max_requests = 3;
  options_.deadline = std::chrono::minutes(1);
  options_.linger = std::chrono::minutes(1);
  Serve();
  const auto requests = AskForWhatHangs(3);
  auto told = AskForWhatHangs(3);  // that it is too much, and stay
  for (const auto& peer : told) {
    EXPECT_THAT(peer->ReceiveAll(), HasSubstr("503 "));
  }
  EXPECT_EQ(Ask(port_, "/here").status, 0);
  told.clear();
  EXPECT_EQ(AskUntil(port_, "/here", 503).status, 503);
}

TEST_F(HttpServerTest, WhoIsSilentForLongestMakesRoom) {
  options_.max_silent = 3;
  options_.deadline = std::chrono::minutes(1);
  Serve();
  std::vector<std::unique_ptr<HttpPeer>> silent;
  for (int i = 0; i < 5; ++i) {
    silent.push_back(std::make_unique<HttpPeer>(port_));
    silent.back()->Send("GET /here HT");
  }
  EXPECT_EQ(silent[0]->ReceiveAll(), "");
  EXPECT_EQ(silent[1]->ReceiveAll(), "");
  for (std::size_t i = 2; i < 5; ++i) {
    silent[i]->Send("TP/1.1\r\n\r\n");
    EXPECT_EQ(silent[i]->ReceiveAnswer().value_or(HttpAnswer()).status, 200) << i;
  }
}

TEST_F(HttpServerTest, WhoseRequestIsWholeMakesNoRoom) {
  options_.max_silent = 1;
  options_.deadline = std::chrono::minutes(1);
  Serve();
  const auto requests = AskForWhatHangs(3);
  const HttpPeer silent(port_);
  EXPECT_EQ(Ask(port_, "/here").status, 200);
  Release();
  for (const auto& peer : requests) {
    EXPECT_EQ(peer->ReceiveAnswer().value_or(HttpAnswer()).status, 200);
  }
}

TEST_F(HttpServerTest, APageThatHangsHoldsUpNoOther) {
  options_.deadline = milliseconds(200);
  Serve();
  const HttpAnswer late = Ask(port_, "/hangs");
  EXPECT_EQ(late.status, 503);
  EXPECT_THAT(late.body, HasSubstr("not answer in time"));
  EXPECT_EQ(AskUntil(port_, "/here", 200).status, 200);
}

TEST_F(HttpServerTest, APageThatHangsIsNotWaitedForByMoreThanTheLimit) {
  options_.max_requests = 2;
  options_.deadline = milliseconds(200);
  Serve();
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(Ask(port_, "/hangs").status, 503);
  }
}

TEST_F(HttpServerTest, APageThatThrowsIs500) {
  Serve();
  EXPECT_EQ(Ask(port_, "/throws").status, 500);
  EXPECT_EQ(Ask(port_, "/here").status, 200);
}

}  // namespace
}  // namespace atlas
