#include "tests/bench/serving/quiet_crowd.h"

#include <array>
#include <utility>

#include <poll.h>

#include "core/base/str_cat.h"
#include "proto/wire/envelope.h"
#include "tests/bench/serving/load_frames.h"

namespace atlas::testing {
namespace {

constexpr int kPatience_ms = 10'000;

}  // namespace

Status QuietCrowd::Open(std::size_t idle, std::size_t slow) {
  request_ = StatusFrame(2);
  for (std::size_t i = 0; i < idle; ++i) {
    ATLAS_RETURN_IF_ERROR(Add(idle_));
  }
  for (std::size_t i = 0; i < slow; ++i) {
    ATLAS_RETURN_IF_ERROR(Add(slow_));
    // Their requests are whole at different times.
    ATLAS_RETURN_IF_ERROR(SendNext(slow_.back(), i % request_.size()));
  }
  begin_ = Clock::now();
  return {};
}

Status QuietCrowd::Add(std::vector<Member>& members) {
  auto socket = LoadSocket::Connect(port_, tls_);
  if (!socket) {
    return socket.error().WithContext(StrCat("connection ", idle_.size() + slow_.size()));
  }
  Member member;
  member.socket = *std::move(socket);
  ATLAS_RETURN_IF_ERROR(member.socket->Send(HelloFrame()));
  member.awaited = 1;
  ATLAS_RETURN_IF_ERROR(ReadUntilAnswered(member));
  members.push_back(std::move(member));
  return {};
}

Status QuietCrowd::Tick() {
  if (slow_.empty()) {
    return {};
  }
  const std::chrono::duration<double> passed = Clock::now() - begin_;
  const auto due = static_cast<std::size_t>(passed.count() * static_cast<double>(slow_.size()));
  for (; due_sent_ < due; ++due_sent_) {
    Member& member = slow_[due_sent_ % slow_.size()];
    ATLAS_RETURN_IF_ERROR(SendNext(member, 1));
    const std::size_t awaited = member.awaited;
    ATLAS_RETURN_IF_ERROR(Read(member));
    slow_replies_ += awaited - member.awaited;
  }
  return {};
}

Status QuietCrowd::CheckAll() {
  for (Member& member : idle_) {
    ATLAS_RETURN_IF_ERROR(Read(member));
    ATLAS_RETURN_IF_ERROR(SendNext(member, request_.size()));
    ATLAS_RETURN_IF_ERROR(ReadUntilAnswered(member));
  }
  for (Member& member : slow_) {
    ATLAS_RETURN_IF_ERROR(Read(member));
  }
  return {};
}

Status QuietCrowd::SendNext(Member& member, std::size_t bytes) {
  if (bytes == 0) {
    return {};
  }
  const std::size_t at = member.sent % request_.size();
  ATLAS_RETURN_IF_ERROR(member.socket->Send(ByteSpan(request_).subspan(at, bytes)));
  member.sent += bytes;
  member.awaited += member.sent % request_.size() == 0 ? 1u : 0u;
  return {};
}

Status QuietCrowd::Read(Member& member) {
  std::array<std::uint8_t, 4'096> buffer{};
  while (true) {
    const LoadSocket::Moved came = member.socket->Receive(buffer);
    if (came.is_closed) {
      return {StatusCode::kUnavailable, "the daemon closed a connection that kept to the rules"};
    }
    if (came.bytes == 0) {
      return {};
    }
    member.replies.Push(ByteSpan(buffer).first(came.bytes));
    for (auto payload = member.replies.Next();; payload = member.replies.Next()) {
      if (!payload) {
        return payload.error();
      }
      if (!*payload) {
        break;
      }
      const auto reply = ParseEnvelope(**payload);
      const bool is_expected = reply && (reply->has_status_reply() || reply->has_hello_reply());
      if (!is_expected || member.awaited == 0) {
        return {StatusCode::kInvalidData, "the daemon answered something else"};
      }
      --member.awaited;
    }
  }
}

Status QuietCrowd::ReadUntilAnswered(Member& member) {
  while (true) {
    ATLAS_RETURN_IF_ERROR(Read(member));
    if (member.awaited == 0) {
      return {};
    }
    pollfd wait{member.socket->descriptor(), POLLIN, 0};
    if (::poll(&wait, 1, kPatience_ms) <= 0) {
      return {StatusCode::kTimeout, "no reply within 10 s"};
    }
  }
}

}  // namespace atlas::testing
