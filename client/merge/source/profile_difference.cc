#include "client/merge/source/profile_difference.h"

#include "core/base/str_cat.h"

namespace atlas {

std::string DifferenceOf(const MapProfile& one, const MapProfile& other) {
  if (one == other) return "";
  std::string text;
  const auto add = [&](bool differs, const std::string& what) {
    if (differs) text += (text.empty() ? "" : ", ") + what;
  };
  add(one.cell_size_um != other.cell_size_um,
      StrCat("cells of ", one.cell_size_m(), " m instead of ", other.cell_size_m(), " m"));
  add(one.tile_cells != other.tile_cells,
      StrCat("tiles of ", one.tile_cells, " cells a side instead of ", other.tile_cells));
  add(one.levels != other.levels,
      StrCat(int{one.levels}, " levels instead of ", int{other.levels}));
  add(one.column_segments != other.column_segments,
      StrCat("columns of ", int{one.column_segments}, " segments instead of ",
             int{other.column_segments}));
  add(one.segment_height_mm != other.segment_height_mm,
      StrCat("segments of ", one.segment_height_m(), " m instead of ", other.segment_height_m(),
             " m"));
  add(one.preset != other.preset, StrCat("preset ", FusionPresetName(one.preset), " instead of ",
                                         FusionPresetName(other.preset)));
  return text.empty() ? "other rules of fusion, or another origin" : text;
}

}  // namespace atlas
