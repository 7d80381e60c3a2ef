#include "core/base/disk_error.h"

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
    case EFBIG:
    case EMFILE:
    case ENFILE:
    case ENOMEM:
      return StatusCode::kResourceExhausted;
    case ENOENT:
      return StatusCode::kNotFound;
    case ENOTDIR:
    case EISDIR:
    case ENOTEMPTY:
    case EEXIST:
      return StatusCode::kConflict;
    default:
      return StatusCode::kUnavailable;
  }
}

}  // namespace

Status DiskError(std::string_view what, const std::filesystem::path& path, int error) {
  return {CodeOf(error),
          StrCat(what, ' ', path.string(), ": ", std::generic_category().message(error))};
}

}  // namespace atlas
