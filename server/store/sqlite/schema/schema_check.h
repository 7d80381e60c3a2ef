// Whether the tables and indexes that a file tells SQLite of are those of an atlas. No checksum
// covers that text: with a turned bit in it SQLite takes the same pages for other tables, and the
// file opens.
#pragma once

#include <string>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

struct SchemaDamage {
  std::string what;  // names a table or an index, and says what differs; empty: nothing does
  // The text says something else than that of an atlas, which is known.
  bool can_be_put_back = false;

  bool is_none() const { return what.empty(); }
};

// Of an atlas from kFirstReadableVersion on. Words are compared, not how they are laid out. An
// index that is gone is for CheckIndexes(); tables of others change nothing and are left alone.
// Throws where SQLite cannot read the schema, unless the connection takes any.
SchemaDamage FindSchemaDamage(Connection& connection);
// The same as kInvalidData, with what to do.
Status CheckSchema(Connection& connection);

// Puts back every text that can be, inside a transaction of a connection that takes any schema, and
// makes the indexes anew of which it was. From then on the connection takes none but whole ones.
// What there was, for people. Throws as the connection does.
std::string PutSchemaBack(Connection& connection);

}  // namespace atlas
