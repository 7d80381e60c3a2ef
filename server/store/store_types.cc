#include "server/store/store_types.h"

#include <algorithm>

#include "core/base/str_cat.h"

namespace atlas {

Status StoreIdentity::CheckNotLost(std::uint64_t revision) const {
  const auto found = std::find_if(lost.begin(), lost.end(), [revision](const LostRevisions& range) {
    return range.after < revision && revision < range.before;
  });
  if (found == lost.end()) {
    return {};
  }
  return {StatusCode::kNotFound,
          StrCat("revision ", revision, " is lost: the atlas went on from revision ", found->after,
                 ", that of a backup or of what its log still told")};
}

}  // namespace atlas
