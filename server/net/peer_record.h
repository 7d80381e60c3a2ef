// Who a peer is, as the log names it, and where what it does is counted. For the thread of its
// connection.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/str_cat.h"
#include "server/base/line_budget.h"
#include "server/base/log_line.h"
#include "server/net/net_counters.h"
#include "server/net/peer_share.h"

namespace atlas {

struct PeerRecord {
  std::string address;    // "ADDRESS:PORT"
  std::string client;     // what it calls itself; empty until it is greeted
  std::string name;       // of its certificate or token; empty: it has none
  NetCounters& counters;  // of its thread, as is the next
  LineBudget& lines;      // about requests
  std::chrono::milliseconds slow_request;
  // Of its name or address; null: it may have all there is.
  std::shared_ptr<PeerShare> share = nullptr;

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
};

}  // namespace atlas
