#include "server/store/sqlite/schema/schema_text.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string_view>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/schema.h"

namespace atlas {
namespace {

constexpr int kCache_kib = 64;
constexpr std::size_t kShown = 40;  // bytes of a word

bool IsSpace(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\f' || c == '\r';
}

bool IsOfWord(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return std::isalnum(byte) != 0 || c == '_' || c == '$' || byte >= 0x80U;
}

// Where the word ends that begins at `at`, which is no space.
std::size_t EndOfWord(std::string_view sql, std::size_t at) {
  if (sql[at] == '"') {
    const std::size_t end = sql.find('"', at + 1);
    return end == std::string_view::npos ? sql.size() : end + 1;
  }
  std::size_t end = at + 1;
  while (IsOfWord(sql[at]) && end < sql.size() && IsOfWord(sql[end])) {
    ++end;
  }
  return end;
}

std::string InSmallLetters(std::string_view word) {
  std::string small(word);
  for (char& c : small) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return small;
}

// What is damaged may be of any bytes.
std::string Shown(std::string_view word) {
  std::string shown(word.substr(0, kShown));
  for (char& c : shown) {
    c = std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
  }
  return shown.empty() ? "nothing" : shown;
}

std::string InsteadOf(std::string_view found, std::string_view expected) {
  return StrCat(Shown(found), " instead of ", Shown(expected));
}

std::string DifferenceOfWords(const std::string& expected, const std::string& found) {
  const std::vector<std::string> ours = WordsOf(expected);
  const std::vector<std::string> theirs = WordsOf(found);
  const auto [our, their] = std::mismatch(ours.begin(), ours.end(), theirs.begin(), theirs.end());
  if (our == ours.end() && their == theirs.end()) {
    return {};
  }
  return InsteadOf(their == theirs.end() ? "" : *their, our == ours.end() ? "" : *our);
}

std::vector<SchemaObject> MakeAtlasSchema() {
  Connection connection({":memory:", DatabaseOptions::Mode::kCreate, kCache_kib, 0});
  CreateTables(connection);
  return ReadSchema(connection);
}

}  // namespace

std::vector<SchemaObject> ReadSchema(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT rowid, rootpage, type, name, tbl_name, coalesce(sql, '') FROM sqlite_master "
      "ORDER BY rowid");
  std::vector<SchemaObject> schema;
  while (row.Step()) {
    row.Rewind();
    SchemaObject object;
    object.row = row.Int();
    object.root = row.Int();
    object.type = row.Text();
    object.name = row.Text();
    object.table = row.Text();
    object.sql = row.Text();
    object.is_whole = row.fits();
    schema.push_back(std::move(object));
  }
  return schema;
}

const std::vector<SchemaObject>& AtlasSchema() {
  static const std::vector<SchemaObject> kSchema = MakeAtlasSchema();
  return kSchema;
}

std::vector<std::string> WordsOf(const std::string& sql) {
  std::vector<std::string> words;
  for (std::size_t at = 0; at < sql.size();) {
    if (IsSpace(sql[at])) {
      ++at;
      continue;
    }
    const std::size_t end = EndOfWord(sql, at);
    words.push_back(InSmallLetters(std::string_view(sql).substr(at, end - at)));
    at = end;
  }
  const bool is_quoted = words.size() > 2 && words[1] == "table" && words[2].size() > 2 &&
                         words[2].front() == '"' && words[2].back() == '"';
  if (is_quoted) {
    words[2] = words[2].substr(1, words[2].size() - 2);
  }
  return words;
}

std::string DifferenceOf(const SchemaObject& expected, const SchemaObject& found) {
  if (found.name != expected.name) {
    return InsteadOf(found.name, expected.name);
  }
  if (found.table != expected.table) {
    return InsteadOf(found.table, expected.table);
  }
  if (found.type != expected.type) {
    return InsteadOf(found.type, expected.type);
  }
  const std::string words = DifferenceOfWords(expected.sql, found.sql);
  return words.empty() && !found.is_whole ? "its row has another type" : words;
}

}  // namespace atlas
