#include "server/store/store_types.h"

#include <algorithm>

#include "core/base/str_cat.h"
#include "server/store/backup_types.h"

namespace atlas {

Status StoreIdentity::CheckNotLost(std::uint64_t revision) const {
  const auto lost = std::find_if(restores.begin(), restores.end(), [revision](std::uint64_t next) {
    return revision < next && next - revision <= kRevisionsLeftOut;
  });
  if (lost == restores.end()) {
    return {};
  }
  return {
      StatusCode::kNotFound,
      StrCat("revision ", revision, " is lost: the atlas went on from revision ",
             *lost - kRevisionsLeftOut - 1, ", that of a backup or of what its log still told")};
}

}  // namespace atlas
