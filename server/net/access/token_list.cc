#include "server/net/access/token_list.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>
#include <utility>

#include <openssl/crypto.h>
#include <openssl/sha.h>

#include "core/base/str_cat.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {
namespace {

Status Malformed(const std::string& why) {
  return {StatusCode::kInvalidData, why};
}

template <typename T>
bool ParseWhole(std::string_view text, T& value, int base = 10) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return error == std::errc() && end == text.data() + text.size();
}

// The end of that day, UTC, in ms since 1970.
std::optional<std::int64_t> EndOfDay(std::string_view text) {
  int year = 0;
  unsigned month = 0;
  unsigned day = 0;
  if (text.size() != 10 || text[4] != '-' || text[7] != '-' ||
      !ParseWhole(text.substr(0, 4), year) || !ParseWhole(text.substr(5, 2), month) ||
      !ParseWhole(text.substr(8, 2), day)) {
    return std::nullopt;
  }
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month),
                                         std::chrono::day(day)};
  if (!date.ok()) {
    return std::nullopt;
  }
  const auto next = std::chrono::sys_days(date) + std::chrono::days(1);
  return std::chrono::duration_cast<std::chrono::milliseconds>(next.time_since_epoch()).count();
}

}  // namespace

TokenHash HashOfToken(std::string_view token) {
  TokenHash hash{};
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), hash.data());
  return hash;
}

Result<TokenList> TokenList::Read(const std::filesystem::path& file) {
  std::error_code ignored;  // what cannot be looked at cannot be read either
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return Error(StatusCode::kNotFound, StrCat("there is no file of tokens ", file.string()));
  }
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in.is_open() || in.bad()) {
    return Error(StatusCode::kPermissionDenied,
                 StrCat("the file of tokens ", file.string(), " cannot be read"));
  }
  return Parse(text, file.string());
}

Result<TokenList> TokenList::Parse(std::string_view text, const std::string& origin) {
  TokenList list;
  std::istringstream lines{std::string(text)};
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    line.erase(std::min(line.find('#'), line.size()));
    if (line.find_first_not_of(" \t\r") == std::string::npos) {
      continue;
    }
    Result<Entry> entry = ParseLine(line);
    if (!entry) {
      return Error(entry.error().WithContext(StrCat(origin, ": line ", number)));
    }
    list.entries_.push_back(*std::move(entry));
  }
  return list;
}

Result<TokenList::Entry> TokenList::ParseLine(const std::string& line) {
  std::istringstream words(line);
  std::string role;
  std::string expires;
  std::string hash;
  std::string more;
  Entry entry;
  if (!(words >> entry.owner.name >> role >> expires >> hash) || words >> more) {
    return Error(Malformed("expected NAME ROLE EXPIRES SHA256"));
  }
  if (Status status = ValidateName("the owner", entry.owner.name); !status.ok()) {
    return Error(Malformed(status.message()));
  }
  const std::optional<Role> known = RoleByName(role);
  if (!known || *known == Role::kNone) {
    return Error(Malformed(
        StrCat("there is no role '", role, "', expected reader, vehicle, merge or admin")));
  }
  entry.owner.role = *known;
  entry.expires_ms = EndOfDay(expires);
  if (!entry.expires_ms && expires != "never") {
    return Error(Malformed(StrCat("'", expires, "', expected a day (2027-06-30) or never")));
  }
  bool is_hash = hash.size() == 2 * entry.hash.size();
  for (std::size_t i = 0; is_hash && i < entry.hash.size(); ++i) {
    is_hash = ParseWhole(std::string_view(hash).substr(2 * i, 2), entry.hash[i], 16);
  }
  if (!is_hash) {
    return Error(Malformed("expected the SHA-256 of the token, 64 hex digits"));
  }
  return entry;
}

Result<TokenOwner> TokenList::Find(const TokenHash& token, std::int64_t now_ms) const {
  for (const Entry& entry : entries_) {
    if (CRYPTO_memcmp(entry.hash.data(), token.data(), token.size()) != 0) {
      continue;
    }
    if (entry.expires_ms && now_ms >= *entry.expires_ms) {
      return Error(StatusCode::kPermissionDenied,
                   StrCat("the token of ", entry.owner.name, " has expired: ask for a new one"));
    }
    return entry.owner;
  }
  return Error(StatusCode::kPermissionDenied, "the daemon does not know this token");
}

}  // namespace atlas
