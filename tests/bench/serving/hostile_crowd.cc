#include "tests/bench/serving/hostile_crowd.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <random>
#include <span>

#include <poll.h>

#include "tests/bench/serving/heavy_frames.h"
#include "tests/bench/serving/load_frames.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kPatience{2'000};  // of one who waits to be thrown out, or does not read
constexpr milliseconds kLongPatience{100'000};
constexpr std::uint64_t kRequestsUnread = 64;

// Of a sync's reply; tiles and manifests are passed over unread: they are larger.
wire::Envelope::BodyCase EndOf(ByteSpan payload) {
  constexpr std::size_t kEndBytes = 256;
  const auto reply = payload.size() > kEndBytes ? wire::Envelope() : ParseEnvelope(payload);
  return reply ? reply->body_case() : wire::Envelope::BODY_NOT_SET;
}

// One visit.
struct Visit {
  LoadSocket& socket;
  const Bytes& hello;
  std::mt19937_64& random;
  const std::stop_token& stop;
  FrameDecoder replies = FrameDecoder();

  // False: the daemon has closed.
  bool Say(ByteSpan bytes) { return socket.Send(bytes).ok(); }
  bool Greet() { return Say(hello); }

  // Reads and forgets, until the daemon closes or patience ends.
  void WaitForTheEnd() {
    std::array<std::uint8_t, 16'384> buffer{};
    const auto end = Clock::now() + kPatience;
    while (Clock::now() < end && !stop.stop_requested()) {
      pollfd wait{socket.descriptor(), POLLIN, 0};
      ::poll(&wait, 1, 50);
      if (socket.Receive(buffer).is_closed) {
        return;
      }
    }
  }
  // To the Hello, and to what came after it.
  void WaitForAReply() {
    std::array<std::uint8_t, 16'384> buffer{};
    int awaited = 2;
    while (awaited > 0 && !stop.stop_requested()) {
      pollfd wait{socket.descriptor(), POLLIN, 0};
      ::poll(&wait, 1, 50);
      const LoadSocket::Moved came = socket.Receive(buffer);
      if (came.is_closed) {
        return;
      }
      replies.Push(ByteSpan(buffer).first(came.bytes));
      while (replies.Next().value_or(std::nullopt)) {
        --awaited;
      }
    }
  }
  // To its end; false: the daemon has closed or refused it, or enough is enough.
  bool WaitForASync() {
    std::array<std::uint8_t, 65'536> buffer{};
    while (!stop.stop_requested()) {
      while (const auto payload = replies.Next().value_or(std::nullopt)) {
        const auto end = EndOf(*payload);
        if (end == wire::Envelope::kSyncEnd || end == wire::Envelope::kError) {
          return end == wire::Envelope::kSyncEnd;
        }
      }
      pollfd wait{socket.descriptor(), POLLIN, 0};
      ::poll(&wait, 1, 50);
      const LoadSocket::Moved came = socket.Receive(buffer);
      if (came.is_closed) {
        return false;
      }
      replies.Push(ByteSpan(buffer).first(came.bytes));
    }
    return false;
  }
  void Idle(milliseconds time) {
    const auto end = Clock::now() + time;
    while (Clock::now() < end && !stop.stop_requested()) {
      std::this_thread::sleep_for(milliseconds(20));
    }
  }
};

void RandomBytes(Visit& visit) {
  Bytes noise(4'096);
  for (std::uint8_t& byte : noise) {
    byte = static_cast<std::uint8_t>(visit.random());
  }
  visit.Say(noise);
  visit.WaitForTheEnd();
}

void ClaimsMoreThanThereMayBe(Visit& visit) {
  visit.Greet();
  Bytes header = EncodeHeader({0, 1});
  std::fill_n(header.begin() + 4, 4, std::uint8_t{0xff});  // the length
  visit.Say(header);
  visit.WaitForTheEnd();
}

// As much as there may be, of which little comes.
void ClaimsAndStalls(Visit& visit) {
  visit.Greet();
  visit.Say(EncodeHeader({kMaxFrameBytes, 1}));
  visit.Say(Bytes(65'536));
  visit.Idle(kPatience);
}

void LeavesWithinAFrame(Visit& visit) {
  visit.Greet();
  const Bytes frame = StatusFrame(2);
  visit.Say(ByteSpan(frame).first(frame.size() / 2));
  visit.socket.ResetAtClose();
}

void SpoilsAChecksum(Visit& visit) {
  visit.Greet();
  Bytes frame = StatusFrame(2);
  frame.back() ^= 1;
  visit.Say(frame);
  visit.WaitForTheEnd();
}

void SaysNoHello(Visit& visit) {
  visit.Say(StatusFrame(1));
  visit.WaitForTheEnd();
}

void SaysNothing(Visit& visit) {
  visit.WaitForTheEnd();
}

void LeavesAtOnce(Visit& visit) {
  visit.socket.ResetAtClose();
}

// Asks for the whole atlas again and again, and reads nothing of it.
void AskAndNeverRead(Visit& visit, Bytes (*frame)(std::uint64_t), milliseconds patience) {
  visit.Greet();
  for (std::uint64_t i = 0; i < kRequestsUnread; ++i) {
    visit.Say(frame(i + 2));
  }
  visit.Idle(patience);
  visit.socket.ResetAtClose();
}

void NeverReads(Visit& visit) {
  AskAndNeverRead(visit, &QueryFrame, kPatience);
}

// Until the daemon has enough of it, or the crowd goes.
void NeverReadsQueries(Visit& visit) {
  AskAndNeverRead(visit, &QueryFrame, kLongPatience);
}

void NeverReadsSyncs(Visit& visit) {
  AskAndNeverRead(visit, &SyncAllFrame, kLongPatience);
}

// Valid to the last bit but one: the message is none.
void SendsNoMessage(Visit& visit) {
  visit.Greet();
  const Bytes noise(1'024, 0xff);
  Bytes frame = EncodeFrameHeader(noise);
  frame.insert(frame.end(), noise.begin(), noise.end());
  visit.Say(frame);
  visit.WaitForTheEnd();
}

// All is as it must be, and takes as long as a request can.
void CorrectsManyPoses(Visit& visit) {
  static const Bytes kFrame = ManyPosesFrame(2);
  visit.Greet();
  visit.Say(kFrame);
  visit.WaitForAReply();
}

void HoldsManyTiles(Visit& visit) {
  static const Bytes kFrame = ManyHeldFrame(2);
  visit.Greet();
  visit.Say(kFrame);
  visit.WaitForAReply();
}

void WatchesManyTiles(Visit& visit) {
  static const Bytes kFrame = ManyWatchedFrame(2);
  visit.Greet();
  visit.Say(kFrame);
  visit.WaitForAReply();
}

void HoldsManyAndNeverReads(Visit& visit) {
  static const Bytes kFrame = ManyHeldInAreaFrame(2);
  visit.Greet();
  visit.Say(kFrame);
  visit.Idle(kLongPatience);
  visit.socket.ResetAtClose();
}

void AsksForAWideCorridor(Visit& visit) {
  static const Bytes kFrame = WideCorridorFrame(2);
  visit.Greet();
  while (visit.Say(kFrame) && visit.WaitForASync()) {
  }
}

using Behaviour = void (*)(Visit&);
constexpr Behaviour kBreakRules[] = {&RandomBytes,     &ClaimsMoreThanThereMayBe,
                                     &ClaimsAndStalls, &LeavesWithinAFrame,
                                     &SpoilsAChecksum, &SaysNoHello,
                                     &SaysNothing,     &LeavesAtOnce,
                                     &NeverReads,      &SendsNoMessage};
constexpr Behaviour kAskMuch[] = {&CorrectsManyPoses, &HoldsManyTiles, &WatchesManyTiles};
constexpr Behaviour kAskWide[] = {&AsksForAWideCorridor};
constexpr Behaviour kNeverRead[] = {&NeverReadsQueries, &NeverReadsSyncs};
constexpr Behaviour kHoldUnread[] = {&HoldsManyAndNeverReads};

std::span<const Behaviour> BehavioursOf(Hostility how) {
  switch (how) {
    case Hostility::kAskMuch:
      return kAskMuch;
    case Hostility::kAskWide:
      return kAskWide;
    case Hostility::kNeverRead:
      return kNeverRead;
    case Hostility::kHoldUnread:
      return kHoldUnread;
    case Hostility::kBreakRules:
      break;
  }
  return kBreakRules;
}

}  // namespace

HostileCrowd::HostileCrowd(std::uint16_t port,
                           const LoadTls* tls,
                           const std::string& token,
                           std::size_t peers,
                           Hostility how)
    : port_(port), tls_(tls), hello_(HelloFrame(token)), how_(how) {
  for (std::size_t i = 0; i < peers; ++i) {
    threads_.emplace_back([this, i](const std::stop_token& stop) { Misbehave(i, stop); });
  }
}

void HostileCrowd::Stop() {
  for (std::jthread& thread : threads_) {
    thread.request_stop();
  }
  threads_.clear();
}

void HostileCrowd::Misbehave(std::size_t number, const std::stop_token& stop) {
  std::mt19937_64 random(number);
  const std::span<const Behaviour> behaviours = BehavioursOf(how_);
  const bool is_shaking_hands = tls_ != nullptr && (number / behaviours.size()) % 2 == 0;
  while (!stop.stop_requested()) {
    ++visits_;
    const auto socket = LoadSocket::Connect(port_, is_shaking_hands ? tls_ : nullptr);
    if (!socket) {
      ++refused_;
      continue;
    }
    Visit visit{**socket, hello_, random, stop};
    behaviours[number % behaviours.size()](visit);
  }
}

}  // namespace atlas::testing
