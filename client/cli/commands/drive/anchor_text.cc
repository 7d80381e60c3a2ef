#include "client/cli/commands/drive/anchor_text.h"

#include <numbers>

#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

boost::json::value TransformJson(const std::optional<LevelTransform>& T_map_drive) {
  if (!T_map_drive) return nullptr;
  const Eigen::Vector3d& shift_m = T_map_drive->shift_m;
  return boost::json::object{{"yaw_deg", Rounded(kDegrees * T_map_drive->yaw_rad, 6)},
                             {"x_m", Rounded(shift_m.x(), 4)},
                             {"y_m", Rounded(shift_m.y(), 4)},
                             {"z_m", Rounded(shift_m.z(), 4)}};
}

}  // namespace

boost::json::array AnchorsJson(const std::vector<SessionAnchor>& anchors) {
  boost::json::array array;
  for (const SessionAnchor& anchor : anchors) {
    const PartAnchor& part = anchor.part;
    boost::json::object json{{"session", anchor.key.session},
                             {"anchored", anchor.is_anchored()},
                             {"resumed", anchor.is_resumed},
                             {"transform", TransformJson(part.T_map_drive)}};
    if (!anchor.is_resumed) {
      json["probed"] = part.probed;
      json["found"] = part.found;
      json["agreeing"] = part.agreeing;
      json["tracked"] = part.fit.tracked;
      json["contradicting"] = part.fit.astray;
      json["contradicting_in_a_row"] = part.fit.longest_astray;
      json["rms_m"] = Rounded(part.fit.rms_m, 4);
      json["rms_deg"] = Rounded(kDegrees * part.fit.rms_rad, 4);
      json["worst_rms_m"] = Rounded(part.fit.worst_rms_m, 4);
      json["worst_rms_deg"] = Rounded(kDegrees * part.fit.worst_rms_rad, 4);
      if (part.position_fit.positions > 0) {
        json["positions"] = part.position_fit.positions;
        json["off_positions_m"] = Rounded(part.position_fit.off_m.norm(), 3);
      }
      if (anchor.is_anchored()) {
        json["begins"] = {Rounded(part.begin_m.x(), 3), Rounded(part.begin_m.y(), 3),
                          Rounded(part.begin_m.z(), 3)};
      }
    }
    if (!anchor.is_anchored()) json["why"] = part.why_not;
    array.push_back(std::move(json));
  }
  return array;
}

std::string AnchorText(const SessionAnchor& anchor) {
  const PartAnchor& part = anchor.part;
  if (!part.T_map_drive) return StrCat(anchor.key.session, ": don't know where; ", part.why_not);
  const Eigen::Vector3d& shift_m = part.T_map_drive->shift_m;
  const std::string where =
      StrCat(anchor.key.session, ": turned by ", FixedText(kDegrees * part.T_map_drive->yaw_rad, 3),
             " deg, moved by (", FixedText(shift_m.x(), 3), ", ", FixedText(shift_m.y(), 3), ", ",
             FixedText(shift_m.z(), 3), ") m");
  if (anchor.is_resumed) return where + ", as an earlier run did";
  return StrCat(where, ", begins at (", FixedText(part.begin_m.x(), 1), ", ",
                FixedText(part.begin_m.y(), 1), ", ", FixedText(part.begin_m.z(), 1), ") m; ",
                part.agreeing, " of ", part.found, " scans agree, ", part.fit.tracked,
                " tracked to ", FixedText(part.fit.rms_m, 3), " m and ",
                FixedText(kDegrees * part.fit.rms_rad, 3), " deg RMS");
}

Status CheckAnchored(const std::vector<SessionAnchor>& anchors) {
  std::string unknown;
  for (const SessionAnchor& anchor : anchors) {
    if (anchor.is_anchored()) continue;
    unknown += StrCat(unknown.empty() ? "" : "; ", anchor.key, " (", anchor.part.why_not, ")");
  }
  return unknown.empty() ? Status()
                         : Status(StatusCode::kNotFound,
                                  StrCat("anchor: don't know where in the atlas these sessions "
                                         "lie, which are uploaded, staged, in the drive's own "
                                         "frame: ",
                                         unknown));
}

}  // namespace atlas
