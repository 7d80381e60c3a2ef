#include "client/cli/commands/atlas/timeout_flag.h"

#include "core/base/str_cat.h"

namespace atlas {

void DeclareTimeout(ArgumentSet& arguments, std::chrono::milliseconds& timeout) {
  arguments.Optional(
      "--timeout", "S", timeout,
      StrCat("Give up (exit 5) after so many seconds [", timeout.count() / 1'000, "]"));
}

}  // namespace atlas
