// Stores of every version of the schema that there was, each written by its own code
// (tests/golden/README.md).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <sqlite3.h>

#include "tests/core/support/golden.h"

namespace atlas::testing {

struct EarlierStore {
  const char* name;
  std::int64_t version;

  friend std::ostream& operator<<(std::ostream& out, const EarlierStore& store) {
    return out << store.name;
  }
};

inline constexpr std::array kEarlierStores = {
    EarlierStore{"store_v1_first", 1}, EarlierStore{"store_v1", 1},
    EarlierStore{"store_v2", 2},       EarlierStore{"store_v3_first", 3},
    EarlierStore{"store_v3", 3},       EarlierStore{"store_v3_starts", 3},
    EarlierStore{"store_v4_first", 4}, EarlierStore{"store_v4", 4},
    EarlierStore{"store_v5", 5},
};

// A database that is opened for as long as this lives.
class OpenDatabase {
 public:
  explicit OpenDatabase(const std::filesystem::path& file) {
    if (sqlite3_open(file.c_str(), &db_) != SQLITE_OK) {
      Fail();
    }
  }
  OpenDatabase(const OpenDatabase&) = delete;
  OpenDatabase& operator=(const OpenDatabase&) = delete;
  ~OpenDatabase() { sqlite3_close(db_); }

  void Execute(const std::string& sql) {
    if (sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
      Fail();
    }
  }
  // Each row as one text.
  std::vector<std::string> Select(const std::string& sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(db_, sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
      Fail();
    }
    std::vector<std::string> rows;
    int code = sqlite3_step(statement);
    for (; code == SQLITE_ROW; code = sqlite3_step(statement)) {
      std::string& row = rows.emplace_back();
      for (int i = 0; i < sqlite3_column_count(statement); ++i) {
        const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement, i));
        row += std::to_string(sqlite3_column_type(statement, i)) + ":" +
               std::string(bytes == nullptr ? "" : bytes,
                           static_cast<std::size_t>(sqlite3_column_bytes(statement, i))) +
               "|";
      }
    }
    sqlite3_finalize(statement);
    if (code != SQLITE_DONE) {
      Fail();
    }
    return rows;
  }

 private:
  [[noreturn]] void Fail() const { throw std::runtime_error(sqlite3_errmsg(db_)); }

  sqlite3* db_ = nullptr;
};

inline void MakeEarlierStore(const EarlierStore& store, const std::filesystem::path& database) {
  const Bytes sql = GoldenFile(std::string(store.name) + ".sql");
  std::filesystem::create_directories(database.parent_path());
  OpenDatabase made(database);
  made.Execute(std::string(sql.begin(), sql.end()));
  made.Execute("PRAGMA journal_mode = WAL");
}

inline std::set<std::string> TablesOf(OpenDatabase& database) {
  std::set<std::string> tables;
  for (const std::string& row :
       database.Select("SELECT name FROM sqlite_master WHERE type = 'table'")) {
    tables.insert(row.substr(2, row.size() - 3));
  }
  return tables;
}

// All that is in it.
inline std::vector<std::string> DumpStore(const std::filesystem::path& file) {
  OpenDatabase database(file);
  std::vector<std::string> dump = database.Select("SELECT type, name, sql FROM sqlite_master");
  for (const std::string& table : TablesOf(database)) {
    const auto rows = database.Select("SELECT * FROM " + table + " ORDER BY 1");
    dump.push_back(table);
    dump.insert(dump.end(), rows.begin(), rows.end());
  }
  const auto version = database.Select("PRAGMA user_version");
  dump.insert(dump.end(), version.begin(), version.end());
  return dump;
}

inline std::int64_t SchemaVersionOf(const std::filesystem::path& file) {
  return std::stoll(OpenDatabase(file).Select("PRAGMA user_version").at(0).substr(2));
}

}  // namespace atlas::testing
