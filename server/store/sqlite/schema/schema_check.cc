#include "server/store/sqlite/schema/schema_check.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/schema_text.h"

namespace atlas {
namespace {

constexpr const char* kAdvice =
    "a start of atlasd on it puts that right where nothing else is damaged; else restore a backup";

using Objects = std::vector<const SchemaObject*>;

struct Pair {
  const SchemaObject* expected;
  const SchemaObject* found;
};

// Which object of a file is which of an atlas.
struct Pairing {
  std::vector<Pair> pairs;
  Objects missing;  // of the atlas
  Objects others;   // of the file
};

using Alike = std::function<bool(const SchemaObject& expected, const SchemaObject& found)>;

void PairThose(Pairing& pairing, const Alike& are_alike) {
  Objects missing;
  for (const SchemaObject* expected : pairing.missing) {
    const auto found =
        std::find_if(pairing.others.begin(), pairing.others.end(),
                     [&](const SchemaObject* other) { return are_alike(*expected, *other); });
    if (found == pairing.others.end()) {
      missing.push_back(expected);
    } else {
      pairing.pairs.push_back({expected, *found});
      pairing.others.erase(found);
    }
  }
  pairing.missing = std::move(missing);
}

// By the name; where that is what is damaged, by what is said; where nothing is said, as of a key,
// by the table.
Pairing PairWithAtlas(const std::vector<SchemaObject>& found) {
  Pairing pairing;
  for (const SchemaObject& object : AtlasSchema()) {
    pairing.missing.push_back(&object);
  }
  for (const SchemaObject& object : found) {
    pairing.others.push_back(&object);
  }
  PairThose(pairing, [](const SchemaObject& expected, const SchemaObject& other) {
    return other.name == expected.name;
  });
  PairThose(pairing, [](const SchemaObject& expected, const SchemaObject& other) {
    return !expected.sql.empty() && WordsOf(other.sql) == WordsOf(expected.sql);
  });
  PairThose(pairing, [](const SchemaObject& expected, const SchemaObject& other) {
    return other.type == expected.type && other.table == expected.table &&
           other.sql.empty() == expected.sql.empty();
  });
  return pairing;
}

bool IsOfAtlas(std::string_view table) {
  const std::vector<SchemaObject>& schema = AtlasSchema();
  return std::any_of(schema.begin(), schema.end(), [table](const SchemaObject& object) {
    return object.type == "table" && object.name == table;
  });
}

// What changes what is written, or whether it can be.
bool Meddles(const SchemaObject& other) {
  return other.type == "trigger" || other.type == "view" || IsOfAtlas(other.table);
}

std::string NameOf(const SchemaObject& object) {
  return StrCat(object.type, " ", object.name);
}

std::string DamageOf(const Pair& pair) {
  const std::string difference = DifferenceOf(*pair.expected, *pair.found);
  return difference.empty() ? difference
                            : StrCat("the schema's text of ", NameOf(*pair.expected),
                                     " is damaged (", difference, ")");
}

// Two that begin on one page: what is written to the one is gone from the other. Views, triggers
// and tables that somebody's module keeps begin on none.
std::string FindSharedRoot(const std::vector<SchemaObject>& found) {
  std::map<std::int64_t, const SchemaObject*> roots;
  for (const SchemaObject& object : found) {
    const bool has_pages = object.type == "table" || object.type == "index";
    if (!has_pages || object.root == 0) {
      continue;
    }
    const auto [root, is_first] = roots.emplace(object.root, &object);
    if (!is_first) {
      return StrCat(NameOf(*root->second), " and ", NameOf(object), " begin on one page");
    }
  }
  return {};
}

}  // namespace

SchemaDamage FindSchemaDamage(Connection& connection) {
  const std::vector<SchemaObject> found = ReadSchema(connection);
  const Pairing pairing = PairWithAtlas(found);
  for (const Pair& pair : pairing.pairs) {
    if (std::string damage = DamageOf(pair); !damage.empty()) {
      return {std::move(damage), true};
    }
  }
  for (const SchemaObject* missing : pairing.missing) {
    if (!missing->is_made_index()) {
      return {StrCat(NameOf(*missing), " is missing")};
    }
  }
  for (const SchemaObject* other : pairing.others) {
    if (Meddles(*other)) {
      return {StrCat("it has a ", NameOf(*other), ", and no atlas does")};
    }
  }
  return {FindSharedRoot(found)};
}

Status CheckSchema(Connection& connection) {
  const SchemaDamage damage = FindSchemaDamage(connection);
  return damage.is_none() ? Status()
                          : Status(StatusCode::kInvalidData,
                                   StrCat("store: the database is damaged: ", damage.what, "; ",
                                          damage.can_be_put_back ? kAdvice : "restore a backup"));
}

std::string PutSchemaBack(Connection& connection) {
  const std::vector<SchemaObject> found = ReadSchema(connection);
  std::string damages;
  Objects indexes;
  for (const Pair& pair : PairWithAtlas(found).pairs) {
    const std::string damage = DamageOf(pair);
    if (damage.empty()) {
      continue;
    }
    damages += StrCat(damages.empty() ? "" : "; ", damage);
    Query row = connection.Prepare(
        "UPDATE sqlite_master SET type = ?, name = ?, tbl_name = ?, sql = nullif(?, '') "
        "WHERE rowid = ?");
    row.Bind(std::string_view(pair.expected->type))
        .Bind(std::string_view(pair.expected->name))
        .Bind(std::string_view(pair.expected->table))
        .Bind(std::string_view(pair.expected->sql))
        .Bind(pair.found->row)
        .Run();
    if (pair.expected->is_made_index()) {
      indexes.push_back(pair.expected);
    }
  }
  connection.Execute(
      StrCat("PRAGMA schema_version = ", connection.Ask("PRAGMA schema_version") + 1).c_str());
  connection.TakeWholeSchemasOnly();
  for (const SchemaObject* index : indexes) {
    connection.Execute(StrCat("REINDEX ", index->name).c_str());
  }
  return damages;
}

}  // namespace atlas
