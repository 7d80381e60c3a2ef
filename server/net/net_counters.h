// What one network thread did, counted by it alone: connections, requests and bytes cost it no lock
// and no look-up. Whoever asks adds up the threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/base/status.h"
#include "server/base/duration_histogram.h"
#include "server/base/thread_counter.h"

namespace atlas {

enum class RequestKind : std::uint8_t {
  kHello,
  kUploadKeyframe,
  kUpdatePoses,
  kChangeSession,
  kQueryRegion,
  kSync,
  kStatus,
  kSessions,
  kWait,
  kDigest,
  kVerify,
  kCompact,
  kWatch,
  kCancel,
  kLog,
  kBackup,
  kKeyframes,
  kUndoPoses,
  kReadKeyframes,
  kUnknown,
};
// As metrics and logs call them, in the order of the enumerators.
inline constexpr std::array<std::string_view, 20> kRequestKindNames = {
    "hello",  "upload_keyframe", "update_poses", "change_session", "query_region",
    "sync",   "status",          "sessions",     "wait",           "digest",
    "verify", "compact",         "watch",        "cancel",         "log",
    "backup", "keyframes",       "undo_poses",   "read_keyframes", "unknown"};
inline constexpr std::size_t kRequestKinds = kRequestKindNames.size();
inline constexpr std::size_t kStatusCodes = 1 + static_cast<std::size_t>(StatusCode::kInternal);

inline std::string_view RequestKindName(RequestKind kind) {
  return kRequestKindNames[static_cast<std::size_t>(kind)];
}

// Why a connection was closed that broke no rule but was too slow.
enum class Lateness { kReplies, kFrame, kSilence };
inline constexpr std::array<std::string_view, 3> kLatenessNames = {"replies", "frame", "silence"};
inline constexpr std::array<const char*, 3> kLatenessTexts = {
    "replies were not taken in time", "the rest of a frame did not come in time",
    "nothing came in time"};

// Of all threads; of the moment, but not of one moment.
struct NetFigures {
  struct Kind {
    std::array<std::uint64_t, kStatusCodes> requests{};  // that ended, by outcome
    std::uint64_t late = 0;     // of these, whose deadline passed before they were done
    DurationFigures durations;  // from their last byte to the last reply
  };

  std::uint64_t connections = 0;
  std::uint64_t refused = 0;            // connections since the start
  std::uint64_t handshakes_failed = 0;  // of TLS, that peers began
  std::uint64_t broken_frames = 0;      // each of which ended its connection
  std::array<std::uint64_t, kLatenessNames.size()> late_connections{};  // closed, by Lateness
  std::array<Kind, kRequestKinds> kinds;
  std::uint64_t received_bytes = 0;
  std::uint64_t sent_bytes = 0;
  std::uint64_t in_flight = 0;     // requests now
  std::uint64_t held_bytes = 0;    // of requests now
  std::uint64_t queued_bytes = 0;  // of replies now, that wait for slow readers
  std::uint64_t part_bytes = 0;    // of held_bytes, of large requests not whole or not read
  std::uint64_t parts_closed = 0;  // large requests that had to go for others, since the start
};

struct NetCounters {
  struct Kind {
    std::array<ThreadCounter, kStatusCodes> requests;
    ThreadCounter late;
    DurationHistogram durations;
  };

  std::array<Kind, kRequestKinds> kinds;
  ThreadCounter handshakes_failed;
  ThreadCounter broken_frames;
  std::array<ThreadCounter, kLatenessNames.size()> late_connections;
  ThreadCounter received_bytes;
  ThreadCounter sent_bytes;
  ThreadCounter in_flight;

  void AddTo(NetFigures& figures) const {
    for (std::size_t i = 0; i < kinds.size(); ++i) {
      for (std::size_t code = 0; code < kStatusCodes; ++code) {
        figures.kinds[i].requests[code] += kinds[i].requests[code].value();
      }
      figures.kinds[i].late += kinds[i].late.value();
      kinds[i].durations.AddTo(figures.kinds[i].durations);
    }
    figures.handshakes_failed += handshakes_failed.value();
    figures.broken_frames += broken_frames.value();
    for (std::size_t i = 0; i < late_connections.size(); ++i) {
      figures.late_connections[i] += late_connections[i].value();
    }
    figures.received_bytes += received_bytes.value();
    figures.sent_bytes += sent_bytes.value();
    figures.in_flight += in_flight.value();
  }
};

}  // namespace atlas
