#include "client/cli/output/layer_json.h"

#include "client/cli/output/json_text.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

boost::json::object ColumnJson(const TileLayer& layer, const MapProfile& profile) {
  boost::json::array probabilities;
  for (int i = 0; i < profile.column_segments; ++i) {
    const std::uint8_t nibble = NibbleAt(layer.column, i);
    probabilities.push_back(nibble == 0 ? boost::json::value(nullptr)
                                        : Rounded(NibbleProbability(nibble), 4));
  }
  const std::int64_t base_mm =
      std::int64_t{ColumnBaseIndex(layer.altitude_mm, profile)} * profile.segment_height_mm;
  return {{"base_m", static_cast<double>(base_mm) / 1e3},
          {"segment_m", profile.segment_height_mm / 1e3},
          {"probabilities", std::move(probabilities)}};
}

}  // namespace

boost::json::object LayerJson(const TileLayer& layer, const MapProfile& profile) {
  return {{"z_m", layer.altitude_mm / 1e3},
          {"sigma_m", layer.sigma_100um / 1e4},
          {"occupancy", Rounded(EvidenceProbability(layer.occupancy), 4)},
          {"traversable", layer.is_traversable()},
          {"measured", (layer.flags & TileLayer::kMeasured) != 0},
          {"observations", layer.observations},
          {"confirmed", layer.confirmed_s},
          {"column", ColumnJson(layer, profile)}};
}

}  // namespace atlas
