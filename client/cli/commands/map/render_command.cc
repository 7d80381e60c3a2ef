// `atlas render`: a picture of the whole atlas.
#include <optional>
#include <utility>

#include "client/cli/commands/map/map_commands.h"
#include "client/cli/commands/map/route_check.h"
#include "client/cli/files/contradiction_file.h"
#include "client/cli/files/route_file.h"
#include "client/cli/map_input/opened_map.h"
#include "client/cli/output/json_text.h"
#include "client/map/route_ground.h"
#include "client/render/map_picture.h"
#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"

namespace atlas {
namespace {

LevelReader ReaderOf(MapSource& source, RouteGround& ground, RouteGround& cells) {
  return [&source, &ground, &cells](std::uint8_t level, const TileCallback& on_tile) -> Status {
    return source.ReadLevel(level, std::nullopt, [&](const TileBlob& read) -> Status {
      const Result<Tile> tile = DecodeTile(read.blob, source.profile());
      if (!tile) return tile.error().WithContext(StrCat("tile ", read.id));
      ground.Add(*tile);
      cells.Add(*tile);
      return on_tile(*tile);
    });
  };
}

Rgb ColorOf(ContradictionKind kind) {
  switch (kind) {
    case ContradictionKind::kAppeared:
      return {255, 48, 48};
    case ContradictionKind::kVanished:
      return {64, 144, 255};
    case ContradictionKind::kMoving:
      return {72, 224, 96};
  }
  return {};
}

std::vector<MapMark> MarksOf(const std::vector<ContradictionPlace>& places, double cell_size_m) {
  std::vector<MapMark> marks;
  marks.reserve(places.size());
  for (const ContradictionPlace& place : places) {
    marks.push_back({place.center_m, cell_size_m, ColorOf(place.kind)});
  }
  return marks;
}

std::vector<Eigen::Vector3d> CentersOf(const std::vector<ContradictionPlace>& places) {
  std::vector<Eigen::Vector3d> centers_m;
  for (const ContradictionPlace& place : places) {
    centers_m.emplace_back(place.center_m.x(), place.center_m.y(), 0.0);
  }
  return centers_m;
}

// What lies on no tile contradicts another map, or this one before it changed.
Status NoteCells(const std::string& file, const RouteGround& cells, std::ostream& err) {
  const std::size_t beside = cells.points() - cells.on_tiles();
  if (beside == 0) return {};
  if (cells.on_tiles() == 0) {
    return {StatusCode::kConflict,
            StrCat(file, ": none of its ", cells.points(),
                   " cells lies on a tile of this map: it was written in another one")};
  }
  err << "note: " << beside << " of " << cells.points() << " cells of " << file
      << " lie on no tile of this map\n";
  return {};
}

class RenderCommand : public Command {
 public:
  std::string Name() const override { return "render"; }
  std::string Summary() const override { return "A picture of the map"; }
  bool ReadsAtlasFiles() const override { return true; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("-o,--output", "FILE.png", file_, "Where the picture goes");
    arguments.Optional("--layer", "lowest|highest|N", layer_,
                       "Which surface of a cell is shown; 0 is the lowest [highest]");
    arguments.Choice("--color", {"height", "occupancy", "layers", "columns"}, color_,
                     "What colours mean");
    arguments.Optional("--contradictions", "FILE", contradictions_,
                       "What `atlas localize --contradictions` wrote, drawn over it: red appeared, "
                       "blue vanished, green moves");
    arguments.Optional("--path", "FILE", path_, "A route of `atlas plan --output`, drawn over it");
  }

  Status Run(CommandContext& context) override {
    if (!file_.ends_with(".png")) {
      return {StatusCode::kInvalidArgument, StrCat(file_, ": expected a name that ends in .png")};
    }
    RenderOptions options;
    const auto layer = LayerChoice::Parse(layer_);
    if (!layer) return layer.error();
    options.layer = *layer;
    const auto color = ParseMapColor(color_);
    if (!color) return color.error();
    options.color = *color;
    std::optional<RouteAtlas> planned_in;
    if (!path_.empty()) {
      auto route = ReadRoute(path_);
      if (!route) return route.error();
      options.route = std::move(route->waypoints);
      planned_in = std::move(route->atlas);
    }
    std::vector<ContradictionPlace> contradictions;
    if (!contradictions_.empty()) {
      auto read = ReadContradictions(contradictions_);
      if (!read) return read.error();
      contradictions = *std::move(read);
    }
    const Result<OpenedMap> map = OpenedMap::Open(context);
    if (!map) return map.error();
    options.marks = MarksOf(contradictions, map->profile().cell_size_m());
    RouteGround ground(options.route, map->profile());
    const std::vector<Eigen::Vector3d> centers_m = CentersOf(contradictions);
    RouteGround cells(centers_m, map->profile());
    const auto picture = RenderMap(ReaderOf(map->source(), ground, cells), options, map->profile());
    if (!picture) return picture.error();
    ATLAS_RETURN_IF_ERROR(NoteCells(contradictions_, cells, context.err));
    std::optional<RouteCheck> route;
    if (!path_.empty()) {
      route = CheckOf(path_, planned_in, RouteAtlasOf(map->atlas_id(), map->profile()), ground);
      ATLAS_RETURN_IF_ERROR(NoteRoute(*route, context.err));
    }
    ATLAS_RETURN_IF_ERROR(WritePng(picture->image, file_));
    Print(*picture, route, context);
    return {};
  }

 private:
  void Print(const MapPicture& picture,
             const std::optional<RouteCheck>& route,
             const CommandContext& context) const {
    if (context.is_json) {
      boost::json::object json{{"width", picture.image.width},
                               {"height", picture.image.height},
                               {"metres_per_pixel", Rounded(picture.metres_per_pixel, 6)}};
      if (route) json["route"] = RouteCheckJson(*route);
      context.PrintJson(json);
    } else {
      context.out << file_ << ": " << picture.image.width << " x " << picture.image.height
                  << " pixels of " << picture.metres_per_pixel << " m\n";
    }
  }

  std::string file_;
  std::string path_;
  std::string contradictions_;
  std::string layer_ = "highest";
  std::string color_ = "height";
};

}  // namespace

std::unique_ptr<Command> MakeRenderCommand() {
  return std::make_unique<RenderCommand>();
}

}  // namespace atlas
