#include "tests/client/support/link_way.h"

#include <algorithm>
#include <array>
#include <cerrno>

#include <sys/socket.h>

namespace atlas {
namespace {

constexpr std::size_t kPacketBytes = 1'400;
constexpr std::size_t kQueuedPackets = 16;  // what waits in the network; the rest waits in sockets

}  // namespace

// The first byte waits for a TCP handshake's way there and back, too.
LinkWay::LinkWay(int from, int to, const LinkPace& pace, const LinkCut& cut)
    : from_(from),
      to_(to),
      pace_(pace),
      cut_(cut),
      left_(cut.after_bytes),
      free_at_(Clock::now() + 2 * pace.latency) {}

bool LinkWay::MayRead() const {
  return !has_ended_ && left_ > 0 && packets_.size() < kQueuedPackets;
}

LinkWay::Clock::time_point LinkWay::due() const {
  if (packets_.empty() || IsDue()) return Clock::time_point::max();  // an event says when
  return packets_.front().due;
}

void LinkWay::Read() {
  std::array<std::uint8_t, kPacketBytes> bytes{};
  const auto most = std::min<std::int64_t>(left_, std::int64_t{bytes.size()});
  const ssize_t size = recv(from_, bytes.data(), static_cast<std::size_t>(most), 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  is_broken_ = is_broken_ || size < 0;
  has_ended_ = has_ended_ || size <= 0;
  if (size <= 0) return;
  free_at_ = std::max(free_at_, Clock::now());
  if (pace_.bits_per_s > 0.0) {
    const std::chrono::duration<double> takes(8.0 * static_cast<double>(size) / pace_.bits_per_s);
    free_at_ += std::chrono::duration_cast<Clock::duration>(takes);
  }
  packets_.push_back({free_at_ + pace_.latency, {bytes.begin(), bytes.begin() + size}});
  if (left_ != LinkCut::kNever) left_ -= size;
}

void LinkWay::Deliver(Bytes* passed) {
  while (IsDue() && !is_broken_) {
    Packet& packet = packets_.front();
    const ByteSpan rest = ByteSpan(packet.bytes).subspan(packet.sent);
    const ssize_t size = send(to_, rest.data(), rest.size(), MSG_NOSIGNAL);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    is_broken_ = size < 0;
    if (is_broken_) return;
    const auto sent = static_cast<std::size_t>(size);
    if (passed != nullptr) passed->insert(passed->end(), rest.begin(), rest.begin() + size);
    passed_bytes_ += sent;
    packet.sent += sent;
    if (packet.sent == packet.bytes.size()) packets_.pop_front();
  }
  if (!packets_.empty()) return;
  if (left_ == 0 && !cut_kind_) Strike();
  if (has_ended_ && !is_told_) {
    shutdown(to_, SHUT_WR);
    is_told_ = true;
  }
}

void LinkWay::Strike() {
  if (cut_.stall.count() == 0) {
    cut_kind_ = cut_.kind;
    has_ended_ = cut_.kind == LinkCut::Kind::kHalfClose;
    return;
  }
  ++stalls_;
  free_at_ = Clock::now() + cut_.stall;
  left_ = cut_.after_bytes;
  cut_.stall = std::chrono::milliseconds(0);
}

}  // namespace atlas
