// Limits of the network side: every queue, count and wait has one.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "proto/wire/frame.h"

namespace atlas {

// Of one name, on all its connections.
struct NameLimits {
  std::size_t connections = 64;
  std::size_t held_bytes = 128u << 20;
  double requests_per_s = 1'000;           // 0: no limit, as of the next
  double bytes_per_s = 64u << 20;          // that it sends
  double served_bytes_per_s = 256u << 20;  // that it is sent
  // Fixed when the name comes: a quarter of what all may have.
  std::size_t waits = 4;
  std::size_t watches = 256;
  std::size_t watched_bytes = 16u << 20;
};

struct NetOptions {
  int threads = 2;  // that run connections
  std::size_t max_connections = 4096;
  std::uint32_t max_hello_bytes = 16u << 10;  // payload of a connection's first frame
  std::uint32_t max_frame_bytes = kMaxFrameBytes;
  std::size_t large_frame_bytes = 16u << 10;    // above it is not read on the connection's thread,
  std::size_t copied_frame_bytes = 512u << 10;  // but up to this if it is small but for a blob
  std::size_t max_requests_in_flight = 64;      // a connection
  std::size_t max_queued_bytes = 1u << 20;      // replies waiting for a slow reader, a connection
  // The same of all connections: one queues no more than an eighth of what is left.
  std::size_t max_all_queued_bytes = 16u << 20;
  // Of these in the system's hands and not on their way: half of them take 16 s at 64 kbit/s.
  int max_unsent_bytes = 256 << 10;
  std::size_t max_received_bytes = 64u << 20;  // requests in flight, a connection
  std::size_t max_held_bytes = 512u << 20;     // requests and parts of them, all connections
  std::size_t tile_frame_bytes = 64u << 20;    // tiles ready to be sent, all connections
  // Of an address, for peers without a name: those of this machine are left out, as they are who
  // runs the daemon, unless `is_loopback_limited`.
  NameLimits of_name;
  bool is_loopback_limited = false;
  // Connections of less than a second, or of whoever never said who he is: so many a second of each
  // kind alone. A TLS handshake takes a millisecond, a visit in the clear less than a tenth of it.
  double clear_visits_per_s = 1'000;  // that sent something; 0: no limit of any kind
  double tls_visits_per_s = 200;      // the same, with TLS
  double silent_visits_per_s = 2'000;
  double gone_visits_per_s = 4'000;  // before their turn, or closed at once
  // Of these rates, one address.
  double address_share = 0.25;
  std::size_t max_arrivals = 32;                        // accepted and not begun yet, a thread
  std::size_t max_watches = 1024;                       // all connections
  std::size_t max_watched_bytes = 64u << 20;            // areas of these
  std::size_t max_connection_watched_bytes = 2u << 20;  // of one connection
  std::size_t max_waits = 16;  // for the map to reflect something, all connections
  // Digests, verifications and the like; a quarter of them for merges and administrators alone.
  std::size_t max_works = 16;
  int service_threads = 4;  // for what is short and may block on the disk
  int reply_threads = 4;    // for syncs and queries; half of them of one name
  int reading_threads = 2;  // for digests and verifications, which read all; one of one name
  std::chrono::milliseconds handshake{5'000};
  std::chrono::milliseconds identity_check{60'000};  // who came in may have expired
  std::chrono::milliseconds idle{3'600'000};         // between two frames
  std::chrono::milliseconds frame{30'000};           // how far a frame may stay behind
  std::size_t min_bytes_per_s = 8u << 10;            // this rate
  // In which a peer that lets replies wait takes less than this rate. Loopback moves the window of
  // a slow reader by 64 KiB at a time: at 2 KB/s twice a minute.
  std::chrono::milliseconds write_stall{60'000};
  std::size_t min_write_bytes_per_s = 512;
  std::chrono::milliseconds linger{1'000};        // for a refused peer that still sends to read why
  std::chrono::milliseconds drain{10'000};        // for requests in flight at shutdown
  std::chrono::milliseconds slow_request{1'000};  // from here on the log has it, unless it waits
  std::uint64_t max_log_lines_per_s = 20;         // about requests, a thread; others are counted
};

}  // namespace atlas
