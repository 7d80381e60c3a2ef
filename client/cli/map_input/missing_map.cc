#include "client/cli/map_input/missing_map.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// How sessions of a state come into the map.
struct WayIn {
  std::string_view state;
  std::string_view commands;
};
constexpr std::array kWaysIn = {
    WayIn{"staged", "atlas session publish VEHICLE/SESSION, or atlas-merge run"},
    WayIn{"quarantined", "atlas session release VEHICLE/SESSION"},
    WayIn{"retracted", "atlas session restore VEHICLE/SESSION"},
};

std::string SessionsText(std::span<const SessionSummary> sessions) {
  std::string text;
  for (const WayIn& way : kWaysIn) {
    const auto count =
        std::count_if(sessions.begin(), sessions.end(), [&way](const SessionSummary& session) {
          return session.state == way.state && session.keyframes > 0;
        });
    if (count == 0) continue;
    text += StrCat(text.empty() ? "" : ", ", count, " ", way.state, " (", way.commands, ")");
  }
  return text;
}

}  // namespace

Status MissingMapStatus(const MissingMap& missing) {
  if (missing.dirty_tiles > 0) {
    return {StatusCode::kNotFound,
            StrCat("the atlas has no map yet: ", missing.dirty_tiles, " tiles wait to be fused (",
                   missing.is_file ? "atlasd does that, once it runs on this file's directory"
                                   : "atlas wait returns when they are",
                   ")")};
  }
  const std::string waiting = SessionsText(missing.sessions);
  if (!waiting.empty()) {
    return {StatusCode::kNotFound,
            StrCat("the atlas has no map: none of its sessions is in it, ", waiting)};
  }
  return {StatusCode::kNotFound,
          "the atlas is empty: no drive was uploaded to it (atlas ingest DRIVE, then atlas wait)"};
}

}  // namespace atlas
