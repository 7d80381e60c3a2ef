// Damage to a tree of rows, made by statements: the row of a tile is found no more, and the index
// goes on listing it.
#pragma once

#include <string>

namespace atlas::testing {

// What `statements` do misses an index of the tables' own, which goes on with what it had.
inline std::string WithoutIndex(const std::string& index, const std::string& statements) {
  return "PRAGMA writable_schema = ON;"
         "CREATE TABLE kept AS SELECT * FROM sqlite_master WHERE name = '" +
         index + "'; DELETE FROM sqlite_master WHERE name = '" + index +
         "'; PRAGMA writable_schema = RESET;" + statements +
         "; PRAGMA writable_schema = ON;"
         "INSERT INTO sqlite_master SELECT * FROM kept;"
         "DROP TABLE kept;"
         "PRAGMA writable_schema = RESET;";
}

// Of all tiles of a condition: "key = 7".
inline std::string LoseTiles(const std::string& condition) {
  return WithoutIndex("tile_summaries", "DELETE FROM tiles WHERE " + condition);
}

}  // namespace atlas::testing
