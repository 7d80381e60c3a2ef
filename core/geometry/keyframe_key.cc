#include "core/geometry/keyframe_key.h"

#include <algorithm>
#include <ostream>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

bool IsNameCharacter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-';
}

}  // namespace

Status ValidateName(std::string_view what, std::string_view name) {
  if (name.empty() || name.size() > kMaxNameSize ||
      !std::all_of(name.begin(), name.end(), IsNameCharacter)) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat(what, " name '", name.substr(0, 80),
                         "': expected 1 to 64 characters of A-Z a-z 0-9 . _ -"));
  }
  return {};
}

std::string NameFrom(std::string_view text) {
  std::string name(text.substr(0, kMaxNameSize));
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !IsNameCharacter(c); }, '-');
  return name;
}

Status SessionKey::Validate() const {
  ATLAS_RETURN_IF_ERROR(ValidateName("vehicle", vehicle));
  return ValidateName("session", session);
}

std::ostream& operator<<(std::ostream& out, const SessionKey& key) {
  return out << key.vehicle << '/' << key.session;
}

std::ostream& operator<<(std::ostream& out, const KeyframeKey& key) {
  return out << key.session << '/' << key.sequence;
}

}  // namespace atlas
