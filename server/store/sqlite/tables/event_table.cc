#include "server/store/sqlite/tables/event_table.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/backup_types.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

constexpr auto kLastNumber = std::uint64_t{std::numeric_limits<std::int64_t>::max()};

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
  event.kind = row.Enumerator<EventKind>();
  event.author = row.Text();
  event.subject = row.Text();
  event.detail = row.Text();
  return event;
}

// Nothing if its checksum is another.
std::optional<Event> ReadEvent(Query& row) {
  Event event = ReadColumns(row);
  return row.IsChecksum(HashOf(event)) ? std::optional(std::move(event)) : std::nullopt;
}

// As its columns have it.
struct DamagedRow {
  Event event;
  std::int64_t checksum = 0;
  bool fits = true;  // no column was cut
};

// The first `most`.
std::vector<DamagedRow> ListDamagedEvents(Connection& connection, std::size_t most) {
  Query row = connection.Prepare(
      "SELECT id, revision, time_ms, kind, author, subject, detail, checksum FROM events");
  std::vector<DamagedRow> damaged;
  while (damaged.size() < most && row.Step()) {
    if (!ReadEvent(row)) {
      DamagedRow& last = damaged.emplace_back();
      last.event = ReadColumns(row);
      last.checksum = row.Int();
      last.fits = row.fits();
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
// not fit between its neighbours was another, and gets the next that is free; of a page behind
// which there are more, nobody knows whether one is.
std::vector<Event> PutInOrder(std::vector<Event> events, std::uint64_t after_id, bool has_more) {
  std::vector<Event> ordered;
  std::uint64_t last = after_id;
  std::size_t waiting = 0;
  const auto place = [&] {
    ordered.push_back(DamagedEvent(++last));
    --waiting;
  };
  for (std::size_t i = 0; i < events.size(); ++i) {
    Event& event = events[i];
    const bool is_behind = last < event.id && event.id <= kLastNumber;
    const bool fits = is_behind && (i + 1 == events.size() || event.id < events[i + 1].id);
    if (event.is_damaged && !fits) {
      ++waiting;
      continue;
    }
    while (waiting > 0 && last + 1 < event.id) {
      place();
    }
    if (is_behind) {
      last = event.id;
      ordered.push_back(std::move(event));
    }
  }
  while (waiting > 0 && !has_more) {
    place();
  }
  return ordered;
}

void Insert(Connection& connection, const Event& row) {
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

// With which its row is whole. False: there is none, or another event has it.
bool RestoreNumber(Connection& connection, const DamagedRow& row) {
  for (int bit = 0; row.fits && bit < 64; ++bit) {
    Event event = row.event;
    event.id ^= std::uint64_t{1} << bit;
    if (HashOf(event) == row.checksum) {
      return connection.Prepare("UPDATE OR IGNORE events SET id = ? WHERE id = ?")
                 .Bind(event.id)
                 .Bind(row.event.id)
                 .Run() > 0;
    }
  }
  return false;
}

// The lowest that no event has.
std::uint64_t FreeNumber(Connection& connection) {
  return static_cast<std::uint64_t>(connection.Ask(
      "SELECT min(number) FROM (SELECT 1 AS number UNION ALL SELECT id + 1 FROM events "
      "WHERE id > 0 AND id < 9223372036854775807) WHERE number NOT IN (SELECT id FROM events)"));
}

// Of the nearest one that is whole, in the direction of the statement.
std::optional<std::uint64_t> RevisionBeside(Query row, std::uint64_t id) {
  row.Bind(id);
  while (row.Step()) {
    if (const auto event = ReadEvent(row)) {
      return event->revision;
    }
  }
  return std::nullopt;
}

// Between the two of its neighbours, but no revision that may be lost: it is a known one from now
// on.
std::uint64_t SafeRevision(Connection& connection, const Event& event) {
  const std::uint64_t before =
      RevisionBeside(connection.Prepare("SELECT id, revision, time_ms, kind, author, subject, "
                                        "detail, checksum FROM events WHERE id < ? "
                                        "ORDER BY id DESC"),
                     event.id)
          .value_or(0);
  const std::uint64_t behind =
      RevisionBeside(connection.Prepare("SELECT id, revision, time_ms, kind, author, subject, "
                                        "detail, checksum FROM events WHERE id > ? ORDER BY id"),
                     event.id)
          .value_or(ReadCounter(connection, Counter::kRevision));
  const bool is_certain =
      LineOf(before) == LineOf(behind) && before <= event.revision && event.revision <= behind;
  return is_certain ? event.revision : behind;
}

// By one that says that there was one. A number that was never given is none.
void Replace(Connection& connection, Event event) {
  const std::uint64_t stored = event.id;
  const std::uint64_t last = ReadCounter(connection, Counter::kEvents);
  if (stored == 0 || stored > last) {
    event.id = FreeNumber(connection);
  }
  connection.Prepare("DELETE FROM events WHERE id = ?").Bind(stored).Run();
  if (event.id > last) {
    return;
  }
  event.revision = SafeRevision(connection, event);
  event.kind = EventKind::kTablesRepaired;
  event.author = kAtlasItself;
  event.subject.clear();
  event.detail = "what this event was is not known: its row was damaged";
  Insert(connection, event);
}

}  // namespace

void AddEvent(Connection& connection, const NewEvent& event) {
  Insert(connection, {TakeNumber(connection, Counter::kEvents, "SELECT 1 FROM events WHERE id = ?"),
                      ReadCounter(connection, Counter::kRevision), NowMs(), event.kind,
                      event.author, event.subject, event.detail, false});
}

Result<std::vector<Event>> ReadEvents(Connection& connection,
                                      std::uint64_t after_id,
                                      std::uint32_t limit) {
  Query row = connection.Prepare(
      "SELECT id, revision, time_ms, kind, author, subject, detail, checksum FROM events "
      "WHERE id > ? ORDER BY id LIMIT ?");
  // Numbers begin with 1: one below is damaged, and is not to be passed over.
  row.Bind(after_id == 0 ? std::numeric_limits<std::int64_t>::min()
                         : static_cast<std::int64_t>(after_id))
      .Bind(std::uint64_t{limit} + 1);  // the last one tells whether one before it fits
  std::vector<Event> events;
  while (row.Step()) {
    std::optional<Event> event = ReadEvent(row);
    events.push_back(event ? *std::move(event) : DamagedEvent(ReadColumns(row).id));
  }
  const bool has_more = events.size() > limit;
  events = PutInOrder(std::move(events), after_id, has_more);
  events.resize(std::min(events.size(), std::size_t{limit}));
  return events;
}

void ScanEvents(Connection& connection, const std::function<void(const Event&)>& visit) {
  Query row = connection.Prepare(
      "SELECT id, revision, time_ms, kind, author, subject, detail, checksum FROM events");
  while (row.Step()) {
    const std::optional<Event> event = ReadEvent(row);
    visit(event ? *event : DamagedEvent(ReadColumns(row).id));
  }
}

Status CheckEvents(Connection& connection) {
  const std::vector<DamagedRow> damaged = ListDamagedEvents(connection, 1);
  return damaged.empty() ? Status() : DamageOf(damaged.front().event);
}

int RepairEvents(Connection& connection) {
  const std::vector<DamagedRow> damaged =
      ListDamagedEvents(connection, std::numeric_limits<std::size_t>::max());
  for (const DamagedRow& row : damaged) {
    if (!RestoreNumber(connection, row)) {
      Replace(connection, row.event);
    }
  }
  return static_cast<int>(damaged.size());
}

}  // namespace atlas
