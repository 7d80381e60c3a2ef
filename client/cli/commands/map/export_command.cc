// `atlas export`: the map's columns as a cloud of points that other programs read.
#include "client/cli/command_line/interruption.h"
#include "client/cli/commands/map/map_commands.h"
#include "client/cli/map_input/opened_map.h"
#include "client/cli/output/text_table.h"
#include "client/export/point_file.h"
#include "core/base/str_cat.h"
#include "core/tile/column_points.h"
#include "core/tile/tile_codec.h"

namespace atlas {
namespace {

class ExportCommand : public Command {
 public:
  std::string Name() const override { return "export"; }
  std::string Summary() const override { return "The map's columns as a cloud of points"; }
  bool ReadsAtlasFiles() const override { return true; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("--points", "FILE.pcd|.ply", file_,
                       "Where the points go: the middle of every occupied segment");
    arguments.Optional("--center", "X,Y", center_m_, "Middle of the area, metres [all of it]");
    arguments.Optional("--radius", "R", radius_m_, "Radius of the area, metres");
    arguments.Optional("--origin", "X,Y,Z", origin_m_,
                       "Written as 0,0,0: keeps the float32 of .pcd exact far out [0,0,0]");
  }

  Status Run(CommandContext& context) override {
    const Result<std::optional<DiscArea>> area = Area();
    if (!area) return area.error();
    if (const auto format = PointFormatOf(file_); !format) return format.error();
    const Result<OpenedMap> map = OpenedMap::Open(context);
    if (!map) return map.error();
    Result<PointFile> points = PointFile::Create(file_, origin_m_);
    if (!points) return points.error();
    ATLAS_RETURN_IF_ERROR(WritePoints(map->source(), *area, *points));
    NoteRounding(*points, context.err);
    Print(points->points(), context);
    return {};
  }

 private:
  Result<std::optional<DiscArea>> Area() const {
    if (center_m_.has_value() != radius_m_.has_value()) {
      return Error(StatusCode::kInvalidArgument, "an area needs both --center and --radius");
    }
    if (!center_m_) return std::optional<DiscArea>();
    if (!(*radius_m_ >= 0.0)) {
      return Error(StatusCode::kInvalidArgument,
                   StrCat("radius ", *radius_m_, " m: expected 0 or more"));
    }
    return std::optional(DiscArea{*center_m_, *radius_m_});
  }

  static Status WritePoints(MapSource& source,
                            const std::optional<DiscArea>& area,
                            PointFile& file) {
    const Interruption interruption;
    const Status read = source.ReadLevel(0, area, [&](const TileBlob& blob) -> Status {
      if (Status status = interruption.Check(); !status.ok()) return status;
      const Result<Tile> tile = DecodeTile(blob.blob, source.profile());
      if (!tile) return tile.error().WithContext(StrCat("tile ", blob.id));
      std::vector<ColumnPoint> points = DecodeColumns(*tile, source.profile());
      std::erase_if(points, [&](const ColumnPoint& point) {
        return area && (point.p_world.head<2>() - area->center_m).norm() > area->radius_m;
      });
      return file.Add(points);
    });
    if (!read.ok()) return read;
    if (file.points() == 0) {
      return {StatusCode::kNotFound, "no column stands there: there is nothing to export"};
    }
    return file.Finish();
  }

  static void NoteRounding(const PointFile& points, std::ostream& err) {
    constexpr double kExact_m = 0.001;
    if (points.rounding_m() <= kExact_m) return;
    err << "note: float32 is right to " << FixedText(points.rounding_m(), 3)
        << " m so far out; --origin X,Y,Z near the points, or .ply, is exact\n";
  }

  void Print(std::uint64_t points, const CommandContext& context) const {
    if (context.is_json) {
      context.PrintJson({{"points", points}});
    } else {
      context.out << file_ << ": " << points << " points\n";
    }
  }

  std::string file_;
  std::optional<Eigen::Vector2d> center_m_;
  std::optional<double> radius_m_;
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
};

}  // namespace

std::unique_ptr<Command> MakeExportCommand() {
  return std::make_unique<ExportCommand>();
}

}  // namespace atlas
