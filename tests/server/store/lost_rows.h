// Damage to a tree of rows, made by statements: the row of a tile is found no more, and the index
// goes on listing it.
#pragma once

#include <string>

namespace atlas::testing {

// Of all tiles of a condition: "key = 7".
inline std::string LoseTiles(const std::string& condition) {
  return "PRAGMA writable_schema = ON;"
         "CREATE TABLE kept AS SELECT * FROM sqlite_master WHERE name = 'tile_summaries';"
         "DELETE FROM sqlite_master WHERE name = 'tile_summaries';"
         "PRAGMA writable_schema = RESET;"
         "DELETE FROM tiles WHERE " +
         condition +
         ";"
         "PRAGMA writable_schema = ON;"
         "INSERT INTO sqlite_master SELECT * FROM kept;"
         "DROP TABLE kept;"
         "PRAGMA writable_schema = RESET;";
}

}  // namespace atlas::testing
