// `atlas point X Y`: the surfaces above each other at a place, and what stands on each.
#include "client/cli/commands/map/map_commands.h"
#include "client/cli/map_input/opened_map.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/layer_json.h"
#include "client/cli/output/text_table.h"
#include "client/map/map_view.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

// One character a segment, lowest first: '.' free, '#' occupied, '?' undecided, ' ' no data.
std::string ColumnText(const TileLayer& layer, const MapProfile& profile) {
  std::string text = "|";
  for (int i = 0; i < profile.column_segments; ++i) {
    const std::uint8_t nibble = NibbleAt(layer.column, i);
    const char known = nibble > kNibbleUnknown ? '#' : nibble < kNibbleUnknown ? '.' : '?';
    text += nibble == 0 ? ' ' : known;
  }
  return text + "|";
}

void PrintLayers(const std::vector<TileLayer>& layers,
                 const MapProfile& profile,
                 std::ostream& out) {
  if (layers.empty()) {
    out << "nothing is known here\n";
    return;
  }
  TextTable table({">layer", ">z m", ">sigma m", ">occupancy", "traversable", ">observations",
                   "last seen", "column (lowest first)"});
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const TileLayer& layer = layers[i];
    table.Row({std::to_string(i), FixedText(layer.altitude_mm / 1e3, 3),
               FixedText(layer.sigma_100um / 1e4, 3),
               FixedText(EvidenceProbability(layer.occupancy), 2),
               layer.is_traversable() ? "yes" : "no", std::to_string(layer.observations),
               UtcText(layer.confirmed_s), ColumnText(layer, profile)});
  }
  table.Print(out);
}

class PointCommand : public Command {
 public:
  std::string Name() const override { return "point"; }
  std::string Summary() const override { return "The surfaces at a place, lowest first"; }
  bool ReadsAtlasFiles() const override { return true; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("X", "M", x_m_, "World coordinates of the place");
    arguments.Required("Y", "M", y_m_, "");
    arguments.Optional("--at", "REVISION", at_revision_, "As the atlas was at this revision");
  }

  Status Run(CommandContext& context) override {
    const Result<OpenedMap> map = OpenedMap::Open(context, at_revision_);
    if (!map) return map.error();
    MapView view(map->source());
    const auto layers = view.LayersAt({x_m_, y_m_});
    if (!layers) return layers.error();
    if (context.is_json) {
      boost::json::array array;
      for (const TileLayer& layer : *layers) {
        array.push_back(LayerJson(layer, map->profile()));
      }
      context.PrintJson({{"layers", std::move(array)}});
    } else {
      PrintLayers(*layers, map->profile(), context.out);
    }
    return {};
  }

 private:
  double x_m_ = 0.0;
  double y_m_ = 0.0;
  std::optional<std::uint64_t> at_revision_;
};

}  // namespace

std::unique_ptr<Command> MakePointCommand() {
  return std::make_unique<PointCommand>();
}

}  // namespace atlas
