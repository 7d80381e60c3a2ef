// How far an atlas was committed, in a small file beside its database. A log or a database that was
// removed, cut off or replaced by an older copy is a shorter history that nothing in it contradicts
// (docs/decisions/0511-commits-that-are-missing.md).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "server/store/sqlite/transactions/new_line.h"
#include "server/store/store_types.h"

namespace atlas {

// A log, and how far the database was without it when it began.
struct LogStart {
  std::uint64_t salts = 0;     // which log; 0: none
  std::uint64_t revision = 0;  // at least; 0: not known
};

struct NotedRevision {
  std::array<std::uint8_t, 16> atlas_id{};
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;
  LogStart log;

  // Whether an atlas was further than `revision` of `identity`: what it was given since is missing.
  // Of another atlas nothing is known, nor of one that began another line since.
  bool IsBeyond(const StoreIdentity& identity, std::uint64_t revision) const;
};

// Beside a database of this name.
std::filesystem::path NoteOf(const std::filesystem::path& database);
// Nothing where there is no note at `file`, or none that is whole: then nothing is known.
std::optional<NotedRevision> ReadRevisionNote(const std::filesystem::path& file);

// Where it says that the atlas was. 0: it says nothing of this one.
PlaceInLine PlaceOf(const std::optional<NotedRevision>& noted, const StoreIdentity& identity);

// Written in place behind each commit, and not synced: a commit was, so that a power cut leaves a
// note that says less than the disk has, or nothing. One that the disk refuses does, too: nobody is
// told of it.
//
// When SQLite begins the log anew, all of the one before is in the database, on disk: so all that
// was noted then.
class RevisionNote {
 public:
  // Beside `database`, which is open; made where it is missing. What it says stays until it is
  // written. `log` is the one that was found, and `revision` that of the database without it.
  RevisionNote(const std::filesystem::path& database,
               const StoreIdentity& identity,
               const LogStart& log,
               std::uint64_t revision);
  RevisionNote(const RevisionNote&) = delete;
  RevisionNote& operator=(const RevisionNote&) = delete;
  ~RevisionNote();

  // Of what is committed. By one thread at a time.
  void Write(std::uint64_t revision);

 private:
  NotedRevision noted_;
  int fd_ = -1;      // none: it cannot be opened
  int log_fd_ = -1;  // likewise
};

}  // namespace atlas
