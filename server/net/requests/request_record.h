// One request from its last byte to its last reply: counted, and in the log when it fails or takes
// long. For the thread of its connection.
#pragma once

#include <chrono>
#include <cstdint>
#include <utility>

#include "core/base/status.h"
#include "proto/wire/envelope.h"
#include "server/net/net_counters.h"
#include "server/net/peer_record.h"

namespace atlas {

class RequestRecord {
 public:
  using Clock = std::chrono::steady_clock;

  // `began`: its last byte was there. `peer` outlives this.
  RequestRecord(const PeerRecord& peer,
                const wire::Envelope& request,
                Clock::time_point began = Clock::now());
  RequestRecord(RequestRecord&& other) noexcept
      : peer_(std::exchange(other.peer_, nullptr)),
        id_(other.id_),
        kind_(other.kind_),
        may_wait_(other.may_wait_),
        is_late_(other.is_late_),
        began_(other.began_) {}
  RequestRecord(const RequestRecord&) = delete;
  RequestRecord& operator=(const RequestRecord&) = delete;
  RequestRecord& operator=(RequestRecord&&) = delete;
  // One that never ended was left by an exception: a mistake of the daemon.
  ~RequestRecord() { Count(StatusCode::kInternal, Clock::now()); }

  // Its deadline passed, and it ends well all the same, with less than was asked for.
  void NoteLate() { is_late_ = true; }
  // To be called once, when its last reply is queued or its error known.
  void End(const Status& status);

 private:
  void Count(StatusCode code, Clock::time_point now);
  void Log(const Status& status, Clock::time_point now) const;

  const PeerRecord* peer_;  // null: it ended, or goes on elsewhere
  std::uint64_t id_;
  RequestKind kind_;
  bool may_wait_;         // for others: a long time says nothing
  bool is_late_ = false;  // a status of kTimeout says so, too
  Clock::time_point began_;
};

}  // namespace atlas
