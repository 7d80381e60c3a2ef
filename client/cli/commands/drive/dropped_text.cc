#include "client/cli/commands/drive/dropped_text.h"

#include "core/base/str_cat.h"

namespace atlas {

void AddDropped(std::uint64_t dropped_returns, FactList& facts) {
  if (dropped_returns == 0) return;
  facts.Add("dropped",
            StrCat(dropped_returns, " returns without finite coordinates: nothing came back"));
}

}  // namespace atlas
