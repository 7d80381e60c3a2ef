// Table events: who did what, appended to and never changed.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/store/event_types.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

struct NewEvent {
  EventKind kind = EventKind::kPoses;
  std::string author;
  std::string subject;
  std::string detail;
};

// At the revision that the atlas has now, at the time of the clock.
void AddEvent(Connection& connection, const NewEvent& event);

// Above `after_id` in order, up to `limit`. kInvalidData when one is damaged.
Result<std::vector<Event>> ReadEvents(Connection& connection,
                                      std::uint64_t after_id,
                                      std::uint32_t limit);

// Of all; of damaged ones nothing is told but that they are there.
void ScanEvents(Connection& connection, const std::function<void(const Event&)>& visit);

// kInvalidData names the first that is damaged.
Status CheckEvents(Connection& connection);
// One whose number has a turned bit gets it back. Of others nobody knows more than that they were;
// when, as far as their rows say, and at which revision at the latest. How many.
int RepairEvents(Connection& connection);

}  // namespace atlas
