// The file that says who may do what with a token.
#include "server/net/access/token_list.h"
#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {
namespace {

std::vector<Bytes> Seeds() {
  const std::string hash = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08";
  return {BytesOf("# people\n\nalice admin never " + hash +
                  "  # who runs it\r\nbob\treader 2027-06-30 " + hash + "\n"),
          BytesOf("r2.d-2_x merge 1970-01-01 " + hash)};
}

bool Run(ByteSpan text) {
  const auto list = TokenList::Parse(TextOf(text), "tokens");
  if (!list) {
    return false;
  }
  for (const std::int64_t now_ms : {INT64_MIN, std::int64_t{0}, INT64_MAX}) {
    const auto owner = list->Find(HashOfToken("test"), now_ms);
    Require(!owner || owner->role != Role::kNone, "who has a token has a role");
  }
  return !list->empty();
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz
