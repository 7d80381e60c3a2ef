#include "client/cli/commands/atlas/author_flag.h"

#include <array>
#include <cstdlib>
#include <utility>

#include <pwd.h>
#include <unistd.h>

#include "core/geometry/keyframe_key.h"

namespace atlas {
namespace {

// Empty: nobody that has a name.
std::string LoginName() {
  std::array<char, 16'384> text{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(geteuid(), &entry, text.data(), text.size(), &found) == 0 && found != nullptr) {
    return found->pw_name;
  }
  const char* const user = std::getenv("USER");
  return user == nullptr ? "" : user;
}

}  // namespace

void AuthorFlag::Declare(ArgumentSet& arguments) {
  arguments.Optional("--author", "NAME", given_,
                     "Who does it, for `atlas log` [the login name]; a certificate's or token's "
                     "name goes before it");
}

Result<std::string> AuthorFlag::Author(const std::string& command) const {
  if (given_) {
    if (Status status = ValidateName("author", *given_); !status.ok()) {
      return Error(std::move(status));
    }
    return *given_;
  }
  std::string name = NameFrom(LoginName());
  return name.empty() ? command : name;
}

}  // namespace atlas
