// Commits that an atlas had and that are not there when it is opened: which, what is left of it,
// and how it goes on (docs/decisions/0506-a-damaged-log.md, 0511-commits-that-are-missing.md).
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/damaged_log.h"
#include "server/store/sqlite/revision_note.h"
#include "server/store/store_types.h"

namespace atlas {

// Part of what is lost may have been copied into the database before the damage: then pages of
// different commits are in it, and what is left of the log goes to none of them: kInvalidData, and
// nothing is written. `loss` is what is lost and `changed` what was changed before this, for
// people.
Status CheckWhatIsLeft(Connection& writer, const std::string& loss, const char* changed);

// Which commits are lost, for people: by what the log is, else by how far the atlas is known to
// have been. Empty: none. kInvalidData: as above. Throws as the connection does.
Result<std::string> FindLoss(Connection& writer,
                             const StoreIdentity& identity,
                             const DamagedLog& log,
                             const std::optional<NotedRevision>& noted,
                             const char* changed);

// Begins another line, with an event; vehicles are told by its epoch, as after a restore from a
// backup. `kept` is the copy of the log, if there is one. What happened, for people.
std::string NoteLoss(Connection& writer,
                     StoreIdentity& identity,
                     const std::string& loss,
                     const std::filesystem::path& kept,
                     const std::optional<NotedRevision>& noted);

}  // namespace atlas
