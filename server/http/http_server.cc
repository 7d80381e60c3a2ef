// The one file that includes Beast: it takes long to compile.
#include "server/http/http_server.h"

#include <algorithm>
#include <array>
#include <ctime>
#include <exception>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <spdlog/spdlog.h>

#include "server/http/silent_peers.h"
#include "server/net/places.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kReadAheadBytes = 4u << 10;  // beyond the header

using Parser = http::request_parser<http::empty_body>;
using Response = http::response<http::string_body>;

// A page and the thread that makes it: one that hangs holds up no other.
struct Lane {
  explicit Lane(HttpPage its_page) : page(std::move(its_page)) {}

  HttpPage page;
  std::size_t orders = 0;  // that wait for it; of the server's thread
  asio::thread_pool thread{1};
};

// A page that is being made for one peer.
struct Order {
  explicit Order(asio::io_context& io) : done(io) {}

  asio::steady_timer done;
  std::optional<HttpReply> reply;
};

HttpReply Plain(http::status status, std::string_view body) {
  HttpReply reply;
  reply.status = static_cast<unsigned>(status);
  reply.body = std::string(body) + "\n";
  return reply;
}

HttpReply MakePage(const HttpPage& page) {
  try {
    return page.make();
  } catch (const std::exception& error) {
    spdlog::error("http: {}: {}", page.path, error.what());
    return Plain(http::status::internal_server_error, "a mistake of the daemon");
  }
}

std::string DateText() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  std::array<char, 40> text{};
  std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &utc);
  return text.data();
}

Response MakeResponse(HttpReply reply) {
  Response response(static_cast<http::status>(reply.status), 11);
  response.set(http::field::date, DateText());
  response.set(http::field::content_type, reply.content_type);
  response.set(http::field::cache_control, "no-store");
  if (response.result() == http::status::method_not_allowed) {
    response.set(http::field::allow, "GET, HEAD");
  }
  response.keep_alive(false);
  response.content_length(reply.body.size());
  response.body() = std::move(reply.body);
  return response;
}

// What a request that could not be read is told; nullopt: nobody is there to be told.
std::optional<HttpReply> RefusalOf(const error_code& error) {
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    return Plain(http::status::request_header_fields_too_large, "the header is too large");
  }
  const bool is_malformed = error.category() == make_error_code(http::error::bad_method).category();
  if (is_malformed && error != http::error::end_of_stream &&
      error != http::error::partial_message) {
    return Plain(http::status::bad_request, "this is no HTTP request");
  }
  return std::nullopt;
}

// What is wrong with a request, before anybody looks for its page.
std::optional<HttpReply> RefusalOf(const Parser& parser) {
  const http::verb method = parser.get().method();
  if (method != http::verb::get && method != http::verb::head) {
    return Plain(http::status::method_not_allowed, "GET and HEAD only");
  }
  if (parser.chunked() || parser.content_length().value_or(0) > 0) {
    return Plain(http::status::payload_too_large, "a request has no body here");
  }
  return std::nullopt;
}

}  // namespace

class HttpServer::Impl {
 public:
  Impl(ListenSocket socket, std::vector<HttpPage> pages, const HttpOptions& options)
      : options_(options),
        request_places_(2 * options.max_requests),
        silent_(options.max_silent),
        acceptor_(io_, socket.is_ip6() ? tcp::v6() : tcp::v4(), socket.Release()) {
    for (HttpPage& page : pages) {
      lanes_.push_back(std::make_unique<Lane>(std::move(page)));
    }
    asio::co_spawn(io_, Accept(), &LogFailure);
    thread_ = std::thread([this] { Run(); });
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  // What pages report to goes last.
  ~Impl() {
    io_.stop();
    thread_.join();
    for (const auto& lane : lanes_) {
      lane->thread.join();
    }
  }

 private:
  static void LogFailure(const std::exception_ptr& failure) {
    if (!failure) {
      return;
    }
    try {
      std::rethrow_exception(failure);
    } catch (const std::exception& error) {
      spdlog::error("http: {}", error.what());
    }
  }

  void Run() {
    while (!io_.stopped()) {
      try {
        io_.run();
      } catch (const std::exception& error) {
        spdlog::error("http thread: {}", error.what());
      }
    }
  }

  asio::awaitable<void> Accept() {
    while (true) {
      error_code error;
      tcp::socket socket =
          co_await acceptor_.async_accept(asio::redirect_error(asio::use_awaitable, error));
      if (error) {
        spdlog::warn("http: accept: {}", error.message());
        asio::steady_timer pause(io_, std::chrono::milliseconds(50));
        co_await pause.async_wait(asio::redirect_error(asio::use_awaitable, error));
      } else {
        asio::co_spawn(io_, Converse(std::move(socket)), &LogFailure);
      }
    }
  }

  asio::awaitable<void> Converse(tcp::socket socket) {
    beast::tcp_stream stream(std::move(socket));
    Parser parser;
    parser.header_limit(options_.max_header_bytes);
    parser.body_limit(boost::none);  // whatever is announced: none is read
    const error_code error = co_await ReadHeader(stream, parser);
    std::optional<HttpReply> reply = error ? RefusalOf(error) : RefusalOf(parser);
    if (error && !reply) {
      co_return;
    }
    const Places::Place place = request_places_.Take();
    if (place == nullptr) {
      co_return;
    }
    if (request_places_.taken() > options_.max_requests) {
      reply = Plain(http::status::service_unavailable, "too many requests; try again later");
    }
    if (!reply) {
      reply = co_await ReplyTo(parser);
    }
    const bool is_head = parser.get().method() == http::verb::head;
    co_await Send(stream, *std::move(reply), is_head);
    co_await Linger(stream);
  }

  asio::awaitable<error_code> ReadHeader(beast::tcp_stream& stream, Parser& parser) {
    const SilentPeers::Peer silent(silent_, [&stream] { stream.close(); });
    beast::flat_buffer buffer(options_.max_header_bytes + kReadAheadBytes);
    error_code error;
    stream.expires_after(options_.deadline);
    co_await http::async_read_header(stream, buffer, parser,
                                     asio::redirect_error(asio::use_awaitable, error));
    co_return error;
  }

  asio::awaitable<HttpReply> ReplyTo(const Parser& parser) {
    const auto target = parser.get().target();
    const std::string_view path =
        std::string_view(target.data(), target.size()).substr(0, target.find('?'));
    const auto lane = std::find_if(lanes_.begin(), lanes_.end(),
                                   [path](const auto& l) { return l->page.path == path; });
    if (lane == lanes_.end()) {
      co_return Plain(http::status::not_found, "there is no such page");
    }
    if ((*lane)->orders >= options_.max_requests) {  // it hangs
      co_return Late();
    }
    HttpReply reply = co_await PageOf(**lane);
    co_return reply;
  }

  static HttpReply Late() {
    return Plain(http::status::service_unavailable, "the daemon does not answer in time");
  }

  asio::awaitable<HttpReply> PageOf(Lane& lane) {
    auto order = std::make_shared<Order>(io_);
    order->done.expires_after(options_.deadline);
    ++lane.orders;
    asio::post(lane.thread, [this, &lane, order]() mutable {
      auto deliver = [&lane, order = std::move(order), reply = MakePage(lane.page)]() mutable {
        --lane.orders;
        order->reply = std::move(reply);
        order->done.cancel();
      };
      asio::post(io_, std::move(deliver));
    });
    error_code ignored;  // done, or late
    co_await order->done.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    if (!order->reply) {
      co_return Late();
    }
    co_return *std::move(order->reply);
  }

  asio::awaitable<void> Send(beast::tcp_stream& stream, HttpReply reply, bool is_head) const {
    const Response response = MakeResponse(std::move(reply));
    http::response_serializer<http::string_body> serializer(response);
    serializer.split(is_head);  // whose reply ends with its header
    error_code ignored;         // a peer that is gone
    stream.expires_after(options_.deadline);
    if (is_head) {
      co_await http::async_write_header(stream, serializer,
                                        asio::redirect_error(asio::use_awaitable, ignored));
    } else {
      co_await http::async_write(stream, serializer,
                                 asio::redirect_error(asio::use_awaitable, ignored));
    }
  }

  // Closing a socket with unread bytes resets it, and the peer would lose its reply.
  asio::awaitable<void> Linger(beast::tcp_stream& stream) const {
    error_code error;
    stream.socket().shutdown(tcp::socket::shutdown_send, error);
    stream.expires_after(options_.linger);
    std::array<char, kReadAheadBytes> rest;  // NOLINT(*-member-init)
    while (!error) {
      co_await stream.async_read_some(asio::buffer(rest),
                                      asio::redirect_error(asio::use_awaitable, error));
    }
  }

  HttpOptions options_;
  Places request_places_;
  SilentPeers silent_;
  std::vector<std::unique_ptr<Lane>> lanes_;
  asio::io_context io_{1};  // after what its coroutines refer to
  tcp::acceptor acceptor_;
  std::thread thread_;
};

HttpServer::HttpServer(ListenSocket socket, std::vector<HttpPage> pages, const HttpOptions& options)
    : impl_(std::make_unique<Impl>(std::move(socket), std::move(pages), options)) {}
HttpServer::~HttpServer() = default;

}  // namespace atlas
