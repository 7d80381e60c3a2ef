#include "server/store/sqlite/disk_error.h"

#include <cerrno>
#include <system_error>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

StatusCode CodeOf(int error) {
  switch (error) {
    case EACCES:
    case EPERM:
    case EROFS:
      return StatusCode::kPermissionDenied;
    case ENOSPC:
    case EDQUOT:
      return StatusCode::kResourceExhausted;
    case ENOENT:
      return StatusCode::kNotFound;
    case ENOTDIR:
    case EEXIST:
      return StatusCode::kConflict;
    default:
      return StatusCode::kUnavailable;
  }
}

}  // namespace

Status DiskError(const std::string& what, const std::filesystem::path& path, int error) {
  return {CodeOf(error),
          StrCat(what, " ", path.string(), ": ", std::generic_category().message(error))};
}

}  // namespace atlas
