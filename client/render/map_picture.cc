#include "client/render/map_picture.h"

#include <memory>

#include "client/render/scale_bar.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

// What cells a level has, before there is a raster to draw them on.
void AddContent(const Tile& tile, std::int64_t side, PixelBox& box) {
  for (std::int64_t row = 0; row < side; ++row) {
    for (std::int64_t column = 0; column < side; ++column) {
      if (!tile.Layers(static_cast<std::size_t>(row * side + column)).empty()) {
        box.Add(tile.id.x * side + column, tile.id.y * side + row);
      }
    }
  }
}

PixelBox Finer(const PixelBox& box) {
  return {2 * box.min_x, 2 * box.min_y, 2 * box.max_x + 1, 2 * box.max_y + 1};
}

PixelBox Coarser(const PixelBox& box) {
  return {box.min_x >> 1, box.min_y >> 1, box.max_x >> 1, box.max_y >> 1};
}

bool Fits(const PixelBox& box, std::int64_t side) {
  return box.width() <= side && box.height() <= side;
}

// What is left of a picture's side for the map itself.
std::int64_t MapSide(const RenderOptions& options) {
  return options.max_side_px - 2 * options.margin_px -
         (options.has_scale_bar ? kScaleBarHeight_px : 0);
}

class Renderer {
 public:
  Renderer(const LevelReader& read_level, const RenderOptions& options, const MapProfile& profile)
      : read_level_(read_level),
        options_(options),
        profile_(profile),
        max_side_px_(MapSide(options)) {}

  Result<MapPicture> Run() {
    const auto coarsest = static_cast<std::uint8_t>(profile_.levels - 1);
    if (Status status = DrawCoarsest(coarsest); !status.ok()) return Error(std::move(status));
    for (int level = coarsest - 1; level >= 0 && shift_ == 0; --level) {
      const Result<bool> is_finer = DrawFiner(static_cast<std::uint8_t>(level));
      if (!is_finer) return Error(is_finer.error());
      if (!*is_finer) break;
    }
    const double metres_per_pixel =
        profile_.cell_size_m() * static_cast<double>(std::uint64_t{1} << (level_ + shift_));
    return MapPicture{DrawPicture(*raster_, options_, metres_per_pixel), metres_per_pixel};
  }

 private:
  Status DrawCoarsest(std::uint8_t level) {
    PixelBox box;
    ATLAS_RETURN_IF_ERROR(read_level_(level, [&](const Tile& tile) {
      AddContent(tile, profile_.tile_cells, box);
      return Status();
    }));
    if (box.is_empty()) return {StatusCode::kNotFound, "the atlas is empty: nothing to draw"};
    for (; !Fits(box, max_side_px_); ++shift_) {
      box = Coarser(box);
    }
    level_ = level;
    return Draw(level, box, raster_);
  }

  // False when a picture of this level would be too large.
  Result<bool> DrawFiner(std::uint8_t level) {
    const PixelBox box = Finer(raster_->content());
    if (!Fits(box, max_side_px_ + 2)) return false;
    std::unique_ptr<MapRaster> finer;
    if (Status status = Draw(level, box, finer); !status.ok()) return Error(std::move(status));
    // An atlas that changes while it is read may have lost what the coarser level showed.
    if (finer->content().is_empty() || !Fits(finer->content(), max_side_px_)) return false;
    raster_ = std::move(finer);
    level_ = level;
    return true;
  }

  Status Draw(std::uint8_t level, const PixelBox& box, std::unique_ptr<MapRaster>& raster) {
    raster = std::make_unique<MapRaster>(box, shift_, options_.layer, profile_);
    return read_level_(level, [&](const Tile& tile) {
      raster->Draw(tile);
      return Status();
    });
  }

  const LevelReader& read_level_;
  const RenderOptions& options_;
  const MapProfile& profile_;
  std::int64_t max_side_px_;
  int shift_ = 0;
  int level_ = 0;
  std::unique_ptr<MapRaster> raster_;
};

}  // namespace

Result<MapColor> ParseMapColor(const std::string& text) {
  if (text == "height") return MapColor::kHeight;
  if (text == "occupancy") return MapColor::kOccupancy;
  if (text == "layers") return MapColor::kLayers;
  if (text == "columns") return MapColor::kColumns;
  return Error(StatusCode::kInvalidArgument,
               StrCat("color '", text, "': expected height, occupancy, layers or columns"));
}

Result<MapPicture> RenderMap(const LevelReader& read_level,
                             const RenderOptions& options,
                             const MapProfile& profile) {
  if (MapSide(options) < 1) {
    return Error(StatusCode::kInvalidArgument, "picture: no room left between the margins");
  }
  return Renderer(read_level, options, profile).Run();
}

}  // namespace atlas
