// Who may do what with a token: a file of lines
//
//   NAME ROLE EXPIRES SHA256     # "alice admin 2027-06-30 9f86d081...", the hash of the token
//
// EXPIRES is the last day, UTC, or "never". A token is 32 random bytes as hex, so that its plain
// hash tells nothing about it; the token itself is nowhere but with its owner.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"
#include "server/net/access/role.h"

namespace atlas {

using TokenHash = std::array<std::uint8_t, 32>;  // SHA-256
TokenHash HashOfToken(std::string_view token);

struct TokenOwner {
  std::string name;
  Role role = Role::kNone;
};

class TokenList {
 public:
  TokenList() = default;
  // kNotFound: no such file. kInvalidData names file and line.
  static Result<TokenList> Read(const std::filesystem::path& file);
  static Result<TokenList> Parse(std::string_view text, const std::string& origin);

  bool empty() const { return entries_.empty(); }
  // kPermissionDenied: nobody's, or expired.
  Result<TokenOwner> Find(const TokenHash& token, std::int64_t now_ms) const;

 private:
  struct Entry {
    TokenOwner owner;
    std::optional<std::int64_t> expires_ms;  // since 1970; none: never
    TokenHash hash{};
  };

  static Result<Entry> ParseLine(const std::string& line);

  std::vector<Entry> entries_;
};

}  // namespace atlas
