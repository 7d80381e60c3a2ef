// What becomes of an atlas that another one takes the place of: it is kept beside it.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "core/base/status.h"

namespace atlas {

// Between the name of a database and the number of one that is kept.
inline constexpr std::string_view kReplaced = ".replaced-";

// Whether what an interrupted restore left of an atlas is of the one that is kept under this name.
using MayFollowKept = std::function<bool(const std::filesystem::path& kept)>;

// What there was, under its names from now on.
struct KeptAtlas {
  std::filesystem::path database;           // empty: there was none
  std::vector<std::filesystem::path> left;  // of one that is not there: its log, its note
};

// `database` and what SQLite keeps beside it are called database.replaced-N, by the first number
// behind all that there are, durably. Nothing that is kept is written over. Where the database
// itself is not there, what is left of it follows the last one that is kept, if that lacks it, and
// `may_follow`: also if nothing is left. After an error all is where it was, as far as the disk
// lets it. The caller holds the directory.
Result<KeptAtlas> MoveAside(const std::filesystem::path& database, const MayFollowKept& may_follow);

}  // namespace atlas
