#include "server/net/tcp_server.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <spdlog/spdlog.h>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"
#include "server/base/line_budget.h"
#include "server/net/connection/net_thread.h"
#include "server/net/connection/newcomers.h"
#include "server/net/connection/peer_access.h"
#include "server/net/connection/shared_limits.h"
#include "server/net/connection/visit.h"
#include "server/net/connection/visit_pace.h"
#include "server/net/peer_socket.h"
#include "server/net/places.h"
#include "server/net/requests/request_handler.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

// How soon to look again whether the threads have begun what they were given.
constexpr std::chrono::milliseconds kArrivalPause{1};

VisitPace::Options PaceFrom(const NetOptions& options, bool is_encrypted) {
  VisitPace::Options pace;
  pace.full_per_s = is_encrypted ? options.tls_visits_per_s : options.clear_visits_per_s;
  pace.silent_per_s = options.silent_visits_per_s;
  pace.gone_per_s = options.gone_visits_per_s;
  return pace;
}

// Half of the places are for those who were let in.
Newcomers::Options NewcomersFrom(const NetOptions& options, bool is_encrypted) {
  Newcomers::Options newcomers;
  newcomers.max_open = std::max<std::size_t>(1, options.max_connections / 2);
  newcomers.cost_per_s = options.address_share * PaceFrom(options, is_encrypted).full_per_s;
  return newcomers;
}

}  // namespace

class TcpServer::Impl {
 public:
  Impl(AtlasService& service,
       const NetOptions& options,
       ListenSocket socket,
       ServerSecurity security)
      : options_(options),
        service_(service),
        security_(std::move(security)),
        pool_(static_cast<std::size_t>(options.service_threads)),
        reply_pool_(static_cast<std::size_t>(options.reply_threads),
                    static_cast<std::size_t>(std::max(1, options.reply_threads / 2))),
        reading_pool_(static_cast<std::size_t>(options.reading_threads), 1),
        handler_(service, pool_, reply_pool_, reading_pool_, options_),
        limits_(options),
        places_(options.max_connections),
        pace_(PaceFrom(options, security_.tls != nullptr)),
        newcomers_(NewcomersFrom(options, security_.tls != nullptr)),
        acceptor_(io_, socket.is_ip6() ? tcp::v6() : tcp::v4(), socket.Release()),
        accept_pause_(io_),
        signals_(io_, SIGTERM, SIGINT) {
    std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to peers that are gone, too
    for (int i = 0; i < options.threads; ++i) {
      threads_.push_back(std::make_unique<NetThread>(handler_, limits_, options_));
    }
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  // Calls on the pools and writes of the store report to the threads: none may be left when they
  // go.
  ~Impl() {
    for (const auto& thread : threads_) {
      thread->Stop();
    }
    handler_.Join();
    pool_.join();
    reply_pool_.Join();
    reading_pool_.Join();
    service_.Flush();
  }

  void Run() {
    signals_.async_wait([this](error_code error, int number) {
      if (!error) {
        spdlog::info("signal {}: draining", number);
        Drain();
      }
    });
    asio::co_spawn(io_, Accept(), [](std::exception_ptr failure) {
      if (failure) {
        std::rethrow_exception(failure);
      }
    });
    io_.run();
  }

  void Stop() {
    asio::post(io_, [this] { Drain(); });
  }

  void ChangeSecurity(ServerSecurity security) {
    asio::post(io_, [this, security = std::move(security)] {
      security_ = security;
      for (const auto& thread : threads_) {
        thread->ChangeSecurity(security_);
      }
    });
  }

  void ChangeNameLimits(const NameLimits& limits) { limits_.identities.Change(limits); }

  NetFigures ReadFigures() const {
    NetFigures figures;
    figures.connections = places_.taken();
    figures.refused = refused_.value();
    figures.held_bytes = limits_.held.taken_bytes();
    figures.queued_bytes = limits_.queued.taken_bytes();
    figures.part_bytes = limits_.large.bytes();
    figures.parts_closed = limits_.large.closed();
    for (const auto& thread : threads_) {
      thread->counters().AddTo(figures);
    }
    return figures;
  }
  std::size_t threads() const { return threads_.size(); }
  void Probe(std::size_t thread, std::function<void()> answer) {
    threads_.at(thread)->Probe(std::move(answer));
  }

 private:
  asio::awaitable<void> Accept() {
    while (acceptor_.is_open()) {
      co_await KeepPace();
      if (!acceptor_.is_open()) {
        co_return;
      }
      NetThread& thread = LeastBusyThread();
      error_code error;
      tcp::endpoint peer;
      tcp::socket socket = co_await acceptor_.async_accept(
          thread.io(), peer, asio::redirect_error(asio::use_awaitable, error));
      if (error == asio::error::operation_aborted || !acceptor_.is_open()) {
        co_return;  // whoever came last goes with its socket: nobody would tell it to drain
      }
      if (error) {
        // Out of descriptors or a peer that left: wait a little, serve the others meanwhile.
        NoteAcceptError(error);
        asio::steady_timer pause(io_, std::chrono::milliseconds(50));
        co_await pause.async_wait(asio::redirect_error(asio::use_awaitable, error));
        continue;
      }
      if (IsGone(socket)) {
        pace_.Note(VisitKind::kGone);
      } else {
        Admit(std::move(socket), peer.address(), thread);
      }
    }
  }

  // As long as too many come and go, or more than the threads have begun.
  asio::awaitable<void> KeepPace() {
    auto pause = pace_.Pause(std::chrono::steady_clock::now());
    while (acceptor_.is_open()) {
      if (LeastBusyThread().arrivals() >= options_.max_arrivals) {
        pause = std::max<VisitPace::Clock::duration>(pause, kArrivalPause);
      }
      if (pause == VisitPace::Clock::duration::zero()) {
        co_return;
      }
      accept_pause_.expires_after(std::exchange(pause, VisitPace::Clock::duration::zero()));
      error_code ignored;  // the time is over, or the server stops
      co_await accept_pause_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    }
  }

  // Of those that keep up with what they are given, if there are such, one with the fewest
  // connections.
  NetThread& LeastBusyThread() const {
    const auto rank = [this](const auto& thread) {
      return std::pair(thread->arrivals() >= options_.max_arrivals, thread->connections());
    };
    return **std::min_element(threads_.begin(), threads_.end(),
                              [rank](const auto& a, const auto& b) { return rank(a) < rank(b); });
  }

  void Admit(tcp::socket socket, const asio::ip::address& peer, NetThread& thread) {
    Places::Place place = places_.Take();
    if (place == nullptr) {
      NoteRefusal(peer);
      pace_.Note(VisitKind::kSilent);
      Refuse(std::move(socket));
      return;
    }
    // Those of this machine are left out, as by name.
    const bool is_limited = options_.is_loopback_limited || !IsOfThisMachine(peer);
    const std::string address = is_limited ? SharedAddress(peer) : "";
    const auto now = std::chrono::steady_clock::now();
    if (!newcomers_.Enter(address, now)) {
      NoteRefusal(peer);
      pace_.Note(VisitKind::kGone);  // to say why would cost more than that
      return;
    }
    auto visit = std::make_shared<Visit>(pace_, newcomers_, address, std::move(place), now);
    PreparePeerSocket(socket, options_.max_unsent_bytes);
    SslSession session;
    if (security_.tls != nullptr) {
      session = security_.tls->NewSession(socket.native_handle());
      if (session == nullptr) {
        spdlog::error("TLS: no session for a new connection: {}", TakeTlsErrors());
        return;
      }
    }
    thread.Serve({std::move(socket), std::move(visit), std::move(session), security_});
  }

  // These write one line a second, however many come.
  void NoteAcceptError(const error_code& error) {
    if (accept_error_lines_.Take(std::chrono::steady_clock::now())) {
      spdlog::warn("accept: {}", error.message());
    }
  }
  void NoteRefusal(const asio::ip::address& peer) {
    refused_.Add();
    if (refusal_lines_.Take(std::chrono::steady_clock::now())) {
      spdlog::warn(
          "connections refused: {} by now, the last one of {}; {} are open, {} of them not greeted",
          refused_.value(), SharedAddress(peer), places_.taken(), newcomers_.open());
    }
  }

  // Says why, as far as the socket takes it at once.
  void Refuse(tcp::socket socket) const {
    wire::Envelope envelope;
    *envelope.mutable_error() = ErrorToWire(
        Status(StatusCode::kUnavailable,
               StrCat(options_.max_connections, " connections are open already; try again later")));
    const Result<Bytes> frame = EncodeEnvelopeFrame(envelope);
    error_code ignored;  // the peer is closed either way
    socket.non_blocking(true, ignored);
    if (frame && security_.tls == nullptr) {  // behind TLS it would take a handshake to say so
      socket.write_some(asio::buffer(*frame), ignored);
    }
    socket.shutdown(tcp::socket::shutdown_both, ignored);
  }

  void Drain() {
    if (drain_limit_) {
      return;  // told twice
    }
    service_.EndWaits();
    error_code ignored;  // it may be closed already
    acceptor_.close(ignored);
    accept_pause_.cancel();
    signals_.cancel(ignored);
    for (const auto& thread : threads_) {
      thread->Drain();
    }
    drain_limit_ = std::make_unique<asio::steady_timer>(io_, options_.drain);
    drain_limit_->async_wait([this](error_code error) {
      if (!error) {
        spdlog::warn("requests in flight were cut after {} ms", options_.drain.count());
        io_.stop();
      }
    });
    asio::co_spawn(io_, StopWhenIdle(), asio::detached);
  }

  asio::awaitable<void> StopWhenIdle() {
    asio::steady_timer pause(io_);
    while (places_.taken() > 0) {
      pause.expires_after(std::chrono::milliseconds(10));
      co_await pause.async_wait(asio::use_awaitable);
    }
    drain_limit_->cancel();
  }

  NetOptions options_;
  AtlasService& service_;
  ServerSecurity security_;
  asio::thread_pool pool_;
  FairPool reply_pool_;
  FairPool reading_pool_;
  RequestHandler handler_;
  SharedLimits limits_;
  Places places_;  // of connections
  VisitPace pace_;
  Newcomers newcomers_;
  std::vector<std::unique_ptr<NetThread>> threads_;
  asio::io_context io_{1};  // what accepts; after what its coroutines refer to
  tcp::acceptor acceptor_;
  asio::steady_timer accept_pause_;
  asio::signal_set signals_;
  ThreadCounter refused_;  // connections
  LineBudget refusal_lines_{1};
  LineBudget accept_error_lines_{1};
  std::unique_ptr<asio::steady_timer> drain_limit_;
};

TcpServer::TcpServer(AtlasService& service,
                     const NetOptions& options,
                     ListenSocket socket,
                     ServerSecurity security)
    : impl_(std::make_unique<Impl>(service, options, std::move(socket), std::move(security))) {}
TcpServer::~TcpServer() = default;

void TcpServer::Run() {
  impl_->Run();
}
void TcpServer::Stop() {
  impl_->Stop();
}
void TcpServer::ChangeSecurity(ServerSecurity security) {
  impl_->ChangeSecurity(std::move(security));
}
void TcpServer::ChangeNameLimits(const NameLimits& limits) {
  impl_->ChangeNameLimits(limits);
}
NetFigures TcpServer::ReadFigures() const {
  return impl_->ReadFigures();
}
std::size_t TcpServer::threads() const {
  return impl_->threads();
}
void TcpServer::Probe(std::size_t thread, std::function<void()> answer) {
  impl_->Probe(thread, std::move(answer));
}

}  // namespace atlas
