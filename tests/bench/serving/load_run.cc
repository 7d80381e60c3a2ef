#include "tests/bench/serving/load_run.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <random>

#include <sys/epoll.h>
#include <unistd.h>

#include "core/base/str_cat.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;

Status Failure(const char* what) {
  return {StatusCode::kUnavailable, StrCat(what, ": ", std::strerror(errno))};
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) {
      ::close(number_);
    }
  }
  int get() const { return number_; }

 private:
  int number_;
};

struct LoadPeer {
  std::unique_ptr<LoadSocket> socket;
  std::unique_ptr<ReplyParser> parser;
  Bytes unsent;
  std::size_t awaited = 0;  // replies of the batch under way
  std::size_t asked = 0;    // tiles of it
  Clock::time_point began;
  bool is_greeted = false;
};

class LoadRun {
 public:
  LoadRun(LoadProtocol& protocol, std::span<const LoadTile> tiles, const LoadOptions& options)
      : protocol_(protocol),
        tiles_(tiles),
        options_(options),
        poll_(::epoll_create1(0)),
        random_(options.seed),
        buffer_(1u << 18) {}

  Result<LoadResult> Run() {
    if (Status status = Drive(); !status.ok()) {
      return Error(std::move(status));
    }
    for (const auto& peer : peers_) {
      result_.tile_bytes += peer->parser->tile_bytes();
    }
    return std::move(result_);
  }

 private:
  Status Drive() {
    for (const LoadTile& tile : tiles_) {
      order_.push_back(&tile);
    }
    std::shuffle(order_.begin(), order_.end(), random_);
    end_ = Clock::now();  // of greetings: nothing follows them yet
    for (int i = 0; i < options_.connections; ++i) {
      ATLAS_RETURN_IF_ERROR(Connect());
      if (!peers_.back()->is_greeted) {
        ATLAS_RETURN_IF_ERROR(Begin(*peers_.back()));
      }
    }
    ATLAS_RETURN_IF_ERROR(RunUntilAnswered());
    const auto begin = Clock::now();
    end_ = begin + options_.time;
    for (auto& peer : peers_) {
      ATLAS_RETURN_IF_ERROR(Begin(*peer));
    }
    ATLAS_RETURN_IF_ERROR(RunUntilAnswered());
    result_.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    return {};
  }

  // Until the time is over and no batch is under way.
  Status RunUntilAnswered() {
    while (busy_ > 0) {
      std::array<epoll_event, 64> events{};
      const int count =
          ::epoll_wait(poll_.get(), events.data(), static_cast<int>(events.size()), 10'000);
      if (count == 0) {
        return {StatusCode::kTimeout, "no reply within 10 s"};
      }
      for (int i = 0; i < count; ++i) {
        ATLAS_RETURN_IF_ERROR(
            OnEvent(*static_cast<LoadPeer*>(events[static_cast<std::size_t>(i)].data.ptr)));
      }
    }
    return {};
  }

  Status Connect() {
    auto socket = LoadSocket::Connect(options_.port, options_.tls);
    if (!socket) {
      return socket.error();
    }
    auto peer = std::make_unique<LoadPeer>();
    peer->socket = *std::move(socket);
    peer->parser = protocol_.NewParser();
    peer->is_greeted = protocol_.Greeting().empty();
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.ptr = peer.get();
    if (::epoll_ctl(poll_.get(), EPOLL_CTL_ADD, peer->socket->descriptor(), &event) != 0) {
      return Failure("epoll_ctl");
    }
    peers_.push_back(std::move(peer));
    return {};
  }

  // The next batch.
  Status Begin(LoadPeer& peer) {
    peer.unsent.clear();
    if (!peer.is_greeted) {
      peer.unsent = protocol_.Greeting();
      peer.awaited = 1;
      peer.asked = 0;
    } else {
      batch_.clear();
      for (std::size_t i = 0; i < options_.tiles_per_batch; ++i) {
        batch_.push_back(order_[next_++ % order_.size()]);
      }
      peer.awaited = protocol_.Ask(batch_, options_.mode, peer.unsent);
      peer.asked = batch_.size();
    }
    ++busy_;
    peer.began = Clock::now();
    return peer.socket->Send(peer.unsent);  // small enough for any socket's buffer
  }

  Status OnEvent(LoadPeer& peer) {
    while (true) {
      const LoadSocket::Moved came = peer.socket->Receive(buffer_);
      ++result_.calls;
      if (came.is_closed) {
        return {StatusCode::kUnavailable, "the server closed a connection"};
      }
      if (came.bytes == 0) {
        return {};
      }
      ATLAS_RETURN_IF_ERROR(Take(peer, ByteSpan(buffer_).first(came.bytes)));
      if (!peer.socket->may_hold_more()) {
        return {};
      }
    }
  }

  Status Take(LoadPeer& peer, ByteSpan bytes) {
    result_.wire_bytes += bytes.size();
    if (!peer.parser->Take(bytes)) {
      return {StatusCode::kInvalidData, "the server answered something else"};
    }
    const std::uint64_t replies = peer.parser->TakeReplies();
    if (replies < peer.awaited) {
      peer.awaited -= replies;
      return {};
    }
    const auto now = Clock::now();
    --busy_;
    if (peer.is_greeted) {
      ++result_.batches;
      result_.tiles += peer.asked;
      result_.batch_ms.push_back(
          std::chrono::duration<float, std::milli>(now - peer.began).count());
    }
    peer.is_greeted = true;
    return now < end_ ? Begin(peer) : Status();
  }

  LoadProtocol& protocol_;
  std::span<const LoadTile> tiles_;
  const LoadOptions& options_;
  Descriptor poll_;
  std::mt19937_64 random_;
  Bytes buffer_;
  std::vector<std::unique_ptr<LoadPeer>> peers_;
  std::vector<const LoadTile*> order_;
  std::size_t next_ = 0;
  std::vector<const LoadTile*> batch_;
  std::size_t busy_ = 0;  // peers with a batch under way
  Clock::time_point end_;
  LoadResult result_;
};

}  // namespace

Result<LoadResult> RunLoad(LoadProtocol& protocol,
                           std::span<const LoadTile> tiles,
                           const LoadOptions& options) {
  return LoadRun(protocol, tiles, options).Run();
}

}  // namespace atlas::testing
