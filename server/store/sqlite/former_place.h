// How far the atlases were that a restored one takes the place of: the revisions that they gave are
// given to nothing else.
#pragma once

#include <filesystem>

#include "server/store/sqlite/transactions/new_line.h"
#include "server/store/store_types.h"

namespace atlas {

// The greatest epoch and the greatest revision of `identity`'s atlas that is told by what is at
// `database` and by all that was moved aside there (replaced_atlas.h): by the notes, and by the
// databases with their logs. What cannot be read, or is of another atlas, says nothing. Changes
// none of them, but that SQLite may make the index of a log. The caller holds the directory.
PlaceInLine FindFormerPlace(const std::filesystem::path& database, const StoreIdentity& identity);

// Whether it is sure that the log that `database` left goes on from `kept`, which has none: by the
// note of either, and by how far `kept` is. A log with nothing in it does no harm.
bool DoesLogFollow(const std::filesystem::path& database, const std::filesystem::path& kept);

}  // namespace atlas
