// The name of a keyframe, chosen by the vehicle: uploads are idempotent by it.
#pragma once

#include <compare>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <string_view>

#include "core/base/status.h"

namespace atlas {

inline constexpr std::size_t kMaxNameSize = 64;

// Vehicle and session names: [A-Za-z0-9._-]{1,64}.
Status ValidateName(std::string_view what, std::string_view name);
// Any text as a name: '-' for what a name may not hold, cut to its length. Empty stays empty.
std::string NameFrom(std::string_view text);

struct SessionKey {
  std::string vehicle;
  std::string session;

  Status Validate() const;
  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 sees a null pointer in <=>
  friend auto operator<=>(const SessionKey&, const SessionKey&) = default;
};

struct KeyframeKey {
  SessionKey session;
  std::uint32_t sequence = 0;  // grows along the drive; gaps are fine

  Status Validate() const { return session.Validate(); }
  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 sees a null pointer in <=>
  friend auto operator<=>(const KeyframeKey&, const KeyframeKey&) = default;
};

std::ostream& operator<<(std::ostream& out, const SessionKey& key);   // "vehicle/session"
std::ostream& operator<<(std::ostream& out, const KeyframeKey& key);  // "vehicle/session/12"

}  // namespace atlas
