// What a schema says, object for object, and how two texts of one are compared.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// A row of sqlite_master.
struct SchemaObject {
  std::int64_t row = 0;
  std::string type;
  std::string name;
  std::string table;
  std::string sql;  // empty: an index that SQLite made for a key
  std::int64_t root = 0;
  bool is_whole = true;  // each column is of its type

  // An index, but none of a key: it can be dropped, and made anew.
  bool is_made_index() const { return type == "index" && !sql.empty(); }
};

// All of them, in the order of the rows. Throws as the connection does.
std::vector<SchemaObject> ReadSchema(Connection& connection);
// Those of a new atlas.
const std::vector<SchemaObject>& AtlasSchema();

// What SQLite reads in it, in small letters: neither the layout counts nor the quotes that a table
// which was written anew has around its name.
std::vector<std::string> WordsOf(const std::string& sql);
// For people: which part of the one is another there; empty: none.
std::string DifferenceOf(const SchemaObject& expected, const SchemaObject& found);

}  // namespace atlas
