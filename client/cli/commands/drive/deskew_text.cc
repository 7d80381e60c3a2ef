#include "client/cli/commands/drive/deskew_text.h"

#include <cmath>

#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {

boost::json::object DeskewJson(const DeskewDecision& decision) {
  return {{"deskewed", decision.is_deskewed},
          {"sharper", Rounded(decision.skew->sharper, 4)},
          {"windows", decision.skew->windows},
          {"sharper_windows", decision.skew->sharper_windows}};
}

std::string DeskewText(const DeskewDecision& decision) {
  const DriveSkew& skew = *decision.skew;
  if (skew.windows == 0) return "no: nothing is fast enough to tell";
  return StrCat(decision.is_deskewed ? "yes" : "no", ": structure takes ",
                FixedText(100.0 * std::abs(skew.sharper), 1), " % ",
                skew.sharper > 0.0 ? "less" : "more", " room with it; it is sharper in ",
                skew.sharper_windows, " of the ", skew.windows, " fastest stretches");
}

}  // namespace atlas
