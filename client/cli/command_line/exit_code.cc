#include "client/cli/command_line/exit_code.h"

namespace atlas {

ExitCode ExitCodeFor(StatusCode code) {
  switch (code) {
    case StatusCode::kOk:
      return ExitCode::kSuccess;
    case StatusCode::kInvalidArgument:
      return ExitCode::kUsage;
    case StatusCode::kInvalidData:
      return ExitCode::kInvalidData;
    case StatusCode::kNotFound:
      return ExitCode::kNotFound;
    case StatusCode::kConflict:
      return ExitCode::kConflict;
    case StatusCode::kUnavailable:
    case StatusCode::kTimeout:
      return ExitCode::kUnavailable;
    case StatusCode::kResourceExhausted:
    case StatusCode::kUnsupported:
    case StatusCode::kPermissionDenied:
    case StatusCode::kInternal:
      return ExitCode::kFailure;
  }
  return ExitCode::kFailure;
}

}  // namespace atlas
