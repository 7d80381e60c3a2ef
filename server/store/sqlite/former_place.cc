#include "server/store/sqlite/former_place.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <string>
#include <system_error>

#include "core/base/str_cat.h"
#include "server/store/sqlite/backup/replaced_atlas.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/log_pages.h"
#include "server/store/sqlite/database_files.h"
#include "server/store/sqlite/revision_note.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/schema.h"

namespace atlas {
namespace fs = std::filesystem;
namespace {

constexpr int kCache_kib = 256;
constexpr std::string_view kDigits = "0123456789";

PlaceInLine PlaceOfConnection(Connection& connection, const StoreIdentity& identity) {
  AddRowHash(connection);
  const Result<StoreIdentity> found = ReadMeta(connection);
  if (!found || found->atlas_id != identity.atlas_id) {
    return {};
  }
  const bool is_intact = IsCounterIntact(connection, Counter::kRevision);
  return {found->epoch, is_intact ? ReadCounter(connection, Counter::kRevision) : 0};
}

PlaceInLine PlaceOfDatabase(const fs::path& database, const StoreIdentity& identity) {
  const Result<DatabaseFiles> files = DatabaseFiles::Look(database);
  if (!files) {
    return {};
  }
  try {
    using Mode = DatabaseOptions::Mode;
    Connection connection({files->database, files->is_alone() ? Mode::kUntouched : Mode::kReadOnly,
                           kCache_kib, 0, true});
    return PlaceOfConnection(connection, identity);
  } catch (const std::exception&) {
    return {};  // it is replaced because it is damaged, perhaps
  }
}

void Raise(PlaceInLine& place, const PlaceInLine& other) {
  place.epoch = std::max(place.epoch, other.epoch);
  place.revision = std::max(place.revision, other.revision);
}

}  // namespace

PlaceInLine FindFormerPlace(const fs::path& database, const StoreIdentity& identity) {
  PlaceInLine place = PlaceOf(ReadRevisionNote(NoteOf(database)), identity);
  Raise(place, PlaceOfDatabase(database, identity));
  const std::string begin = StrCat(database.filename().string(), kReplaced);
  const std::string note = NoteOf({}).string();
  std::error_code error;
  for (fs::directory_iterator it(database.parent_path(), error), end; !error && it != end;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (!name.starts_with(begin)) {
      continue;
    }
    if (name.ends_with(note)) {
      Raise(place, PlaceOf(ReadRevisionNote(it->path()), identity));
    } else if (name.find_first_not_of(kDigits, begin.size()) == std::string::npos) {
      Raise(place, PlaceOfDatabase(it->path(), identity));
    }
  }
  return place;
}

bool DoesLogFollow(const fs::path& database, const fs::path& kept) {
  const std::uint64_t salts = ReadLogSalts(database.string() + "-wal");
  if (salts == 0) {
    return true;
  }
  const fs::path note = NoteOf(database);
  std::error_code error;
  const auto noted = ReadRevisionNote(fs::exists(note, error) ? note : NoteOf(kept));
  if (!noted || noted->log.salts != salts) {
    return false;
  }
  StoreIdentity identity;
  identity.atlas_id = noted->atlas_id;
  const PlaceInLine place = PlaceOfDatabase(kept, identity);
  return place.epoch > 0 && place.revision >= noted->log.revision;
}

}  // namespace atlas
