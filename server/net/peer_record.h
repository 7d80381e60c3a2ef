// Who a peer is, as the log names it, and where what it does is counted. For the thread of its
// connection.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/str_cat.h"
#include "server/base/line_budget.h"
#include "server/base/log_line.h"
#include "server/net/access/access_control.h"
#include "server/net/net_counters.h"
#include "server/net/peer_share.h"

namespace atlas {

// What the log takes of the peers of one thread.
struct PeerLines {
  explicit PeerLines(std::uint64_t max_lines_per_s)
      : requests(max_lines_per_s), warnings(max_lines_per_s) {}

  LineBudget requests;
  LineBudget warnings;  // about connections
};

struct PeerRecord {
  std::string address;    // "ADDRESS:PORT"
  std::string client;     // what it calls itself; empty until it is greeted
  std::string name;       // of its certificate or token; empty: it has none
  NetCounters& counters;  // of its thread, as is the next
  PeerLines& lines;
  std::chrono::milliseconds slow_request;
  // Of its name or address; null: it may have all there is.
  std::shared_ptr<PeerShare> share = nullptr;
  Role role = Role::kNone;  // as it was greeted

  void KnowAs(const Identity& identity) {
    name = identity.name;
    role = identity.role;
  }

  // For whom it takes a turn with the others.
  const void* whose() const {
    return share != nullptr ? share.get() : static_cast<const void*>(this);
  }

  LogLine Line(std::string_view message) const {
    LogLine line(StrCat(address, ": ", message), message);
    line.Add("peer", address);
    if (!client.empty()) {
      line.Add("client", client);
    }
    if (!name.empty()) {
      line.Add("name", name);
    }
    return line;
  }
  // A line about its connection, unless there were too many.
  void Warn(const std::string& message) const;
};

}  // namespace atlas
