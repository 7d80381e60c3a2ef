// Expected failures as values: a code that programs act on and a message that people read.
// A message says what failed, on which id, and what was expected.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <tl/expected.hpp>

namespace atlas {

// Frozen: these numbers travel in error replies (docs/protocol.md).
enum class StatusCode : int {
  kOk = 0,
  kInvalidArgument = 1,    // the caller asked for something that makes no sense (usage)
  kInvalidData = 2,        // bytes, files or poses that are not what they must be
  kNotFound = 3,           // no such tile, keyframe, session, file
  kConflict = 4,           // other content under the same key, a stale revision
  kUnavailable = 5,        // closed peer, daemon not there, shutting down; retry may help
  kTimeout = 6,            // a deadline passed
  kResourceExhausted = 7,  // a limit: frame size, full disk, quota
  kUnsupported = 8,        // a version or a feature this build does not know
  kPermissionDenied = 9,   // read-only disk, listening where it is not allowed
  kInternal = 10,          // a promise of this program is broken
};

// It may go away by itself: what is refused so may be sent again (docs/protocol.md, "Errors").
constexpr bool IsTemporary(StatusCode code) {
  return code == StatusCode::kUnavailable || code == StatusCode::kTimeout ||
         code == StatusCode::kResourceExhausted;
}

// What the code alone does not tell. Frozen: the names travel in error replies.
enum class StatusReason : std::uint8_t {
  kNone,
  kQuota,       // of these three: no room for an upload, its vehicle's share is taken,
  kStoreLimit,  // the atlas takes as much as it may,
  kDiskFloor,   // or its disk is nearly full
};

// In snake case, "store_limit"; empty for kNone.
std::string_view StatusReasonName(StatusReason reason);
// kNone for a name that is none.
StatusReason StatusReasonByName(std::string_view name);

// The code's name in snake case, as printed in JSON errors: "invalid_data".
std::string_view StatusCodeName(StatusCode code);

class [[nodiscard]] Status {
 public:
  Status() = default;  // ok
  Status(StatusCode code, std::string message) : code_(code), message_(std::move(message)) {}

  bool ok() const { return code_ == StatusCode::kOk; }
  StatusCode code() const { return code_; }
  const std::string& message() const { return message_; }
  StatusReason reason() const { return reason_; }

  // Milliseconds: the caller may try again after them; none: after what is usual for the code. They
  // travel in error replies where the code IsTemporary.
  std::optional<std::int64_t> retry_after_ms() const { return retry_after_ms_; }

  // The same with "context: " before the message.
  Status WithContext(std::string_view context) const;
  Status WithReason(StatusReason reason) const;
  // The same, to be tried again after so long.
  Status WithRetryAfter(std::int64_t retry_after_ms) const;

  friend bool operator==(const Status&, const Status&) = default;

 private:
  StatusCode code_ = StatusCode::kOk;
  std::string message_;
  StatusReason reason_ = StatusReason::kNone;
  std::optional<std::int64_t> retry_after_ms_;
};

template <typename T>
using Result = tl::expected<T, Status>;

// What a function returning Result<T> returns on failure.
inline tl::unexpected<Status> Error(StatusCode code, std::string message) {
  return tl::unexpected<Status>(Status(code, std::move(message)));
}
inline tl::unexpected<Status> Error(Status status) {
  return tl::unexpected<Status>(std::move(status));
}

}  // namespace atlas

// Leaves the function with the failed Status; for functions that return Status.
#define ATLAS_RETURN_IF_ERROR(expression)                       \
  do {                                                          \
    if (auto atlas_status = (expression); !atlas_status.ok()) { \
      return atlas_status;                                      \
    }                                                           \
  } while (false)
