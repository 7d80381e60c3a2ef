// Who is connected and has not sent a whole request yet: so many at most. One that comes beyond
// takes the place of whoever has been silent for longest, so that silence keeps nobody out. For one
// thread.
#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <utility>

namespace atlas {

class SilentPeers {
 public:
  explicit SilentPeers(std::size_t max_peers) : max_peers_(max_peers) {}
  SilentPeers(const SilentPeers&) = delete;
  SilentPeers& operator=(const SilentPeers&) = delete;
  ~SilentPeers() = default;

  // One of them, until it is destroyed.
  class Peer {
   public:
    // `close`: called once at most, when its place is needed. `all` outlives this.
    Peer(SilentPeers& all, std::function<void()> close) : all_(all), close_(std::move(close)) {
      all_.MakeRoom();
      all_.peers_.push_back(this);
    }
    Peer(const Peer&) = delete;
    Peer& operator=(const Peer&) = delete;
    ~Peer() { all_.peers_.remove(this); }  // closed ones are not there any more

   private:
    friend class SilentPeers;

    SilentPeers& all_;
    const std::function<void()> close_;
  };

 private:
  void MakeRoom() {
    while (!peers_.empty() && peers_.size() >= max_peers_) {
      const Peer& oldest = *peers_.front();
      peers_.pop_front();
      oldest.close_();
    }
  }

  const std::size_t max_peers_;
  std::list<const Peer*> peers_;  // in the order in which they came
};

}  // namespace atlas
