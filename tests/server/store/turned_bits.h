// Single bytes of an atlas's file that nobody has open, changed behind SQLite's back: what a disk
// does to an index.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <sqlite3.h>

namespace atlas::testing {

inline constexpr std::size_t kPageBytes = 8192;

// A number that the closed database tells.
inline std::int64_t AskDatabase(const std::filesystem::path& database, const std::string& sql) {
  sqlite3* db = nullptr;
  EXPECT_EQ(sqlite3_open(database.c_str(), &db), SQLITE_OK);
  sqlite3_stmt* row = nullptr;
  EXPECT_EQ(sqlite3_prepare_v2(db, sql.c_str(), -1, &row, nullptr), SQLITE_OK) << sql;
  EXPECT_EQ(sqlite3_step(row), SQLITE_ROW) << sql;
  const std::int64_t value = sqlite3_column_int64(row, 0);
  sqlite3_finalize(row);
  sqlite3_close(db);
  return value;
}

// Of a table or an index that has one page.
inline std::size_t RootPage(const std::filesystem::path& database, const std::string& name) {
  return static_cast<std::size_t>(
      AskDatabase(database, "SELECT rootpage FROM sqlite_master WHERE name = '" + name + "'"));
}

// Turns `mask` in byte `offset` of the only place where `what` stands in that page, or in the file.
inline void TurnBits(const std::filesystem::path& database,
                     const std::string& page_of,
                     const std::string& what,
                     std::size_t offset,
                     std::uint8_t mask) {
  std::ifstream in(database, std::ios::binary);
  std::string file{std::istreambuf_iterator<char>(in), {}};
  const bool is_anywhere = page_of.empty();
  const std::size_t begin = is_anywhere ? 0 : (RootPage(database, page_of) - 1) * kPageBytes;
  const std::string_view part =
      std::string_view(file).substr(begin, is_anywhere ? file.size() : kPageBytes);
  const std::size_t at = part.find(what);
  ASSERT_NE(at, std::string::npos) << page_of;
  ASSERT_EQ(part.find(what, at + 1), std::string::npos) << page_of << " has it twice";
  char& byte = file[begin + at + offset];
  byte = static_cast<char>(static_cast<std::uint8_t>(byte) ^ mask);
  std::ofstream(database, std::ios::binary) << file;
}

}  // namespace atlas::testing
