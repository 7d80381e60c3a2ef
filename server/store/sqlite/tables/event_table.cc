#include "server/store/sqlite/tables/event_table.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

std::int64_t HashOf(const Event& event) {
  return RowHash(RowKind::kEvent)
      .Unsigned(event.id)
      .Unsigned(event.revision)
      .Int(event.time_ms)
      .Int(static_cast<std::int64_t>(event.kind))
      .Text(event.author)
      .Text(event.subject)
      .Text(event.detail)
      .value();
}

std::int64_t NowMs() {
  using std::chrono::milliseconds;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<milliseconds>(now).count();
}

// The columns of a row in order.
Event ReadColumns(Query& row) {
  row.Rewind();
  Event event;
  event.id = row.Unsigned();
  event.revision = row.Unsigned();
  event.time_ms = row.Int();
  event.kind = static_cast<EventKind>(row.Int());
  event.author = row.Text();
  event.subject = row.Text();
  event.detail = row.Text();
  return event;
}

// Nothing if its checksum is another.
std::optional<Event> ReadEvent(Query& row) {
  Event event = ReadColumns(row);
  return row.Int() == HashOf(event) ? std::optional(std::move(event)) : std::nullopt;
}

// The first `most`, as their columns have them.
std::vector<Event> ListDamagedEvents(Connection& connection, std::size_t most) {
  Query row = connection.Prepare(
      "SELECT id, revision, time_ms, kind, author, subject, detail, checksum FROM events");
  std::vector<Event> damaged;
  while (damaged.size() < most && row.Step()) {
    if (!ReadEvent(row)) {
      damaged.push_back(ReadColumns(row));
    }
  }
  return damaged;
}

Status DamageOf(const Event& event) {
  return {StatusCode::kInvalidData,
          StrCat("store: event ", event.id, " is damaged: wrong checksum")};
}

// Nothing of it but its number.
Event DamagedEvent(std::uint64_t id) {
  Event event;
  event.id = id;
  event.detail = "its row is damaged: wrong checksum";
  event.is_damaged = true;
  return event;
}

// Numbers rise, so that who goes on behind the last one comes to an end: a damaged one that does
// not fit between its neighbours was another, and the one behind the former is free.
void PutInOrder(std::vector<Event>& events, std::uint64_t after_id) {
  std::uint64_t last = after_id;
  for (std::size_t i = 0; i < events.size(); ++i) {
    Event& event = events[i];
    const bool fits = i + 1 == events.size() || event.id < events[i + 1].id;
    if (event.is_damaged && (event.id <= last || !fits)) {
      event.id = last + 1;
    }
    last = std::max(last, event.id);
  }
  last = after_id;
  std::erase_if(events, [&last](const Event& event) {
    const bool is_out_of_order = event.id <= last;
    last = std::max(last, event.id);
    return is_out_of_order;
  });
}

}  // namespace

void AddEvent(Connection& connection, const NewEvent& event) {
  const Event row{AddToCounter(connection, Counter::kEvents, 1),
                  ReadCounter(connection, Counter::kRevision),
                  NowMs(),
                  event.kind,
                  event.author,
                  event.subject,
                  event.detail,
                  false};
  connection
      .Prepare(
          "INSERT INTO events (id, revision, time_ms, kind, author, subject, detail, checksum) "
          "VALUES (?,?,?,?,?,?,?,?)")
      .Bind(row.id)
      .Bind(row.revision)
      .Bind(row.time_ms)
      .Bind(static_cast<std::int64_t>(row.kind))
      .Bind(std::string_view(row.author))
      .Bind(std::string_view(row.subject))
      .Bind(std::string_view(row.detail))
      .Bind(HashOf(row))
      .Run();
}

Result<std::vector<Event>> ReadEvents(Connection& connection,
                                      std::uint64_t after_id,
                                      std::uint32_t limit) {
  Query row = connection.Prepare(
      "SELECT id, revision, time_ms, kind, author, subject, detail, checksum FROM events "
      "WHERE id > ? ORDER BY id LIMIT ?");
  row.Bind(after_id).Bind(limit);
  std::vector<Event> events;
  while (row.Step()) {
    std::optional<Event> event = ReadEvent(row);
    events.push_back(event ? *std::move(event) : DamagedEvent(ReadColumns(row).id));
  }
  PutInOrder(events, after_id);
  return events;
}

std::vector<std::uint64_t> RevisionsOf(Connection& connection, EventKind kind) {
  Query row = connection.Prepare(
      "SELECT id, revision, time_ms, kind, author, subject, detail, checksum FROM events "
      "WHERE kind = ? ORDER BY id");
  row.Bind(static_cast<std::int64_t>(kind));
  std::vector<std::uint64_t> revisions;
  while (row.Step()) {
    if (const auto event = ReadEvent(row)) {
      revisions.push_back(event->revision);
    }
  }
  return revisions;
}

Status CheckEvents(Connection& connection) {
  const std::vector<Event> damaged = ListDamagedEvents(connection, 1);
  return damaged.empty() ? Status() : DamageOf(damaged.front());
}

int RepairEvents(Connection& connection) {
  const std::uint64_t revision = ReadCounter(connection, Counter::kRevision);
  std::vector<Event> damaged =
      ListDamagedEvents(connection, std::numeric_limits<std::size_t>::max());
  for (Event& event : damaged) {
    event.revision = std::min(event.revision, revision);
    event.kind = EventKind::kTablesRepaired;
    event.author = kAtlasItself;
    event.subject.clear();
    event.detail = "what this event was is not known: its row was damaged";
    connection
        .Prepare(
            "UPDATE events SET revision = ?, kind = ?, author = ?, subject = ?, detail = ?, "
            "checksum = ? WHERE id = ?")
        .Bind(event.revision)
        .Bind(static_cast<std::int64_t>(event.kind))
        .Bind(std::string_view(event.author))
        .Bind(std::string_view(event.subject))
        .Bind(std::string_view(event.detail))
        .Bind(HashOf(event))
        .Bind(event.id)
        .Run();
  }
  return static_cast<int>(damaged.size());
}

}  // namespace atlas
